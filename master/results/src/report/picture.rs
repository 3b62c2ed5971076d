//! The canopy as a picture for print: seen from aside without perspective, as the page shows it first.
//!
//! Text is in GNU Unifont, which has the letters of all living scripts, so that any band can be named.

use std::io::{self, Write};

use glam::{DVec2, DVec3};
use nestrad_common::figures::fixed;
use unifont::{Glyph, get_glyph};

use super::scale::Scale;
use crate::error::Fault;

/// Viridis in nine steps, as on the page.
const COLOURS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];
const WIDTH: usize = 1600;
const HEIGHT: usize = 1700;
/// Of the canopy; the colour bar is below it.
const DRAWN_HEIGHT: usize = 1540;
/// Picture points are the mean of so many squared.
const FINER: usize = 2;
const MARGIN: f64 = 40.0;
const AZIMUTH: f64 = -0.9;
const TILT: f64 = 0.45;
/// Picture points along a dot of a letter; letters are 16 dots high, and 8 or 16 wide.
const DOT: usize = 3;
/// Ticks of the colour bar.
const TICKS: usize = 5;

/// A picture of red, green and blue.
#[derive(Debug)]
pub(crate) struct Picture {
    points: Vec<[u8; 3]>,
}

/// Draws triangles, each with a value of 0 to 1, over the colour bar of a scale in a band.
pub(crate) fn draw(
    triangles: impl Iterator<Item = [DVec3; 3]> + Clone,
    value: impl Fn(usize) -> f64,
    scale: &Scale,
    band: &str,
) -> Picture {
    let mut picture = Picture {
        points: vec![[255; 3]; WIDTH * HEIGHT],
    };
    picture.canopy(triangles, value);
    picture.bar(scale, band);
    picture
}

/// Right, up, and towards the eye.
fn axes() -> [DVec3; 3] {
    let ((sa, ca), (st, ct)) = (AZIMUTH.sin_cos(), TILT.sin_cos());
    [
        DVec3::new(-sa, ca, 0.0),
        DVec3::new(-st * ca, -st * sa, ct),
        DVec3::new(ct * ca, ct * sa, st),
    ]
}

impl Picture {
    fn canopy(
        &mut self,
        triangles: impl Iterator<Item = [DVec3; 3]> + Clone,
        value: impl Fn(usize) -> f64,
    ) {
        let [right, up, eye] = axes();
        let seen = |v: DVec3| DVec2::new(v.dot(right), -v.dot(up));
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for vertex in triangles.clone().flatten() {
            low = low.min(seen(vertex));
            high = high.max(seen(vertex));
        }
        let (width, height) = (WIDTH * FINER, DRAWN_HEIGHT * FINER);
        let size = DVec2::new(width as f64, height as f64);
        let scale = ((size - 2.0 * MARGIN) / (high - low).max(DVec2::splat(1e-9))).min_element();
        let middle = (low + high) / 2.0;

        let mut depths = vec![f32::NEG_INFINITY; width * height];
        let mut fine = vec![[255; 3]; width * height];
        for (t, triangle) in triangles.enumerate() {
            let corners = triangle.map(|v| (seen(v) - middle) * scale + size / 2.0);
            let away = triangle.map(|v| v.dot(eye));
            let [a, b, c] = triangle;
            let facing = (b - a).cross(c - a).normalize_or_zero().dot(eye).abs();
            let own = shaded(colour(value(t)), facing);
            cover(corners, away, [width, height], |at, depth| {
                if depth as f32 > depths[at] {
                    depths[at] = depth as f32;
                    fine[at] = own;
                }
            });
        }
        for y in 0..DRAWN_HEIGHT {
            for x in 0..WIDTH {
                let mut sum = [0; 3];
                for k in 0..FINER * FINER {
                    let at = (y * FINER + k / FINER) * width + x * FINER + k % FINER;
                    (0..3).for_each(|part| sum[part] += usize::from(fine[at][part]));
                }
                self.points[y * WIDTH + x] = sum.map(|s| (s / (FINER * FINER)) as u8);
            }
        }
    }

    fn bar(&mut self, scale: &Scale, band: &str) {
        let (left, length, upper, thick) = (200, WIDTH - 400, DRAWN_HEIGHT + 4, 30);
        for x in 0..length {
            let own = colour(x as f64 / (length - 1) as f64);
            for y in upper..upper + thick {
                self.points[y * WIDTH + left + x] = own;
            }
        }
        for tick in 0..TICKS {
            let part = tick as f64 / (TICKS - 1) as f64;
            let sign = match tick {
                0 => "≤ ",
                t if t == TICKS - 1 => "≥ ",
                _ => "",
            };
            let text = format!("{sign}{}", three_digits(scale.value(part)));
            let at = left + (length as f64 * part) as usize;
            self.write(&text, at, upper + thick + 4);
        }
        let unit = " absorbed, W per m² of leaf";
        let room = WIDTH / (8 * DOT) - unit.chars().count() - 2;
        let text = cut(band, room) + unit;
        self.write(&text, left + length / 2, HEIGHT - 16 * DOT - 8);
    }

    /// Text around a place.
    fn write(&mut self, text: &str, middle: usize, upper: usize) {
        let mut left = middle.saturating_sub(width(text) * DOT / 2);
        for character in text.chars() {
            // a mark above or below a letter is drawn over it
            let from = if is_mark(character) {
                left.saturating_sub(8 * DOT)
            } else {
                left
            };
            let Some(glyph) = glyph(character) else {
                continue;
            };
            for (x, y) in (0..glyph.get_width()).flat_map(|x| (0..16).map(move |y| (x, y))) {
                if glyph.get_pixel(x, y) {
                    self.dot(from + x * DOT, upper + y * DOT);
                }
            }
            if !is_mark(character) {
                left += glyph.get_width() * DOT;
            }
        }
    }

    fn dot(&mut self, left: usize, upper: usize) {
        for y in upper..(upper + DOT).min(HEIGHT) {
            for x in left..(left + DOT).min(WIDTH) {
                self.points[y * WIDTH + x] = [0; 3];
            }
        }
    }

    /// Writes the picture as PNG.
    pub(crate) fn write_png(&self, out: &mut impl Write) -> Result<(), Fault> {
        let mut encoder = png::Encoder::new(out, WIDTH as u32, HEIGHT as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let write = || {
            let mut writer = encoder.write_header()?;
            writer.write_image_data(self.points.as_flattened())?;
            writer.finish()
        };
        Ok(write().map_err(io::Error::from)?)
    }
}

/// Three digits that mean something.
fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    fixed(value, if value > 0.0 { decimals } else { 0 })
}

/// What the font has for a character, or for one that it does not have.
fn glyph(character: char) -> Option<&'static Glyph> {
    get_glyph(character).or_else(|| get_glyph(char::REPLACEMENT_CHARACTER))
}

/// Width of a text, dots.
fn width(text: &str) -> usize {
    let shown = text.chars().filter(|&character| !is_mark(character));
    shown.filter_map(glyph).map(Glyph::get_width).sum()
}

fn is_mark(character: char) -> bool {
    matches!(character, '\u{300}'..='\u{36f}')
}

/// A name in so many columns of eight dots at most: a long one is cut, not drawn over the edge.
fn cut(name: &str, columns: usize) -> String {
    if width(name) <= 8 * columns {
        return name.to_owned();
    }
    let mut short = String::new();
    for character in name.chars() {
        short.push(character);
        if width(&short) > 8 * (columns - 2) {
            short.pop();
            break;
        }
    }
    short + "…"
}

/// Calls `each` for the points that a triangle covers, with their depth.
fn cover(
    [a, b, c]: [DVec2; 3],
    depths: [f64; 3],
    [width, height]: [usize; 2],
    mut each: impl FnMut(usize, f64),
) {
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    // a cast to a whole number ends at 0
    let (low, high) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
    for y in low.y as usize..(high.y as usize).min(height) {
        for x in low.x as usize..(high.x as usize).min(width) {
            let point = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let parts = [
                (c - b).perp_dot(point - b) / area,
                (a - c).perp_dot(point - c) / area,
                (b - a).perp_dot(point - a) / area,
            ];
            if parts.iter().all(|&part| part >= 0.0) {
                let depth = parts.iter().zip(depths).map(|(part, d)| part * d).sum();
                each(y * width + x, depth);
            }
        }
    }
}

fn colour(value: f64) -> [u8; 3] {
    let at = value.clamp(0.0, 1.0) * 8.0;
    let (k, part) = ((at as usize).min(7), at - (at as usize).min(7) as f64);
    [0, 1, 2].map(|c| {
        let (from, to) = (f64::from(COLOURS[k][c]), f64::from(COLOURS[k + 1][c]));
        (from + (to - from) * part).round() as u8
    })
}

/// A little shade shows shapes without passing for less light.
fn shaded(colour: [u8; 3], facing: f64) -> [u8; 3] {
    colour.map(|c| (f64::from(c) * (0.86 + 0.14 * facing)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale() -> Scale {
        Scale::of([(0.5, 1.0), (300.0, 1.0)].into_iter())
    }

    /// The dots of the lowest line, which names the band.
    fn name_line(band: &str) -> Vec<[u8; 3]> {
        let picture = draw([].into_iter(), |_| 0.0, &scale(), band);
        picture.points[(HEIGHT - 64) * WIDTH..].to_vec()
    }

    #[test]
    fn names_beyond_ascii_were_blank() {
        let blank = name_line("");
        let replaced = name_line("\u{fffd}");
        for name in ["ü", "µ", "λ", "Ж", "光", "א", "ก", "€", "(", "+", "é"] {
            let line = name_line(name);
            assert!(line != blank && line != replaced, "{name}");
        }
        assert!(name_line("a") != name_line("A"));
        assert!(name_line("e\u{301}") != name_line("e"));
        // what no font has is not passed over
        assert!(name_line("\u{10ffff}") == replaced);
        // and a name that is too long is cut within the picture
        for long in ["near infrared ".repeat(20), "光".repeat(200)] {
            let line = name_line(&long);
            let edge = |x: usize| line.iter().skip(x).step_by(WIDTH).all(|&p| p == [255; 3]);
            assert!(edge(0) && edge(WIDTH - 1) && line != blank);
        }
    }

    #[test]
    fn the_nearer_triangle_is_seen() {
        let [right, up, eye] = axes();
        let at = |depth: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| right * x + up * y + eye * depth)
        };
        for triangles in [[at(0.0), at(1.0)], [at(1.0), at(0.0)]] {
            let nearer = usize::from(triangles[0] == at(0.0));
            let value = |t: usize| if t == nearer { 1.0 } else { 0.0 };
            let picture = draw(triangles.into_iter(), value, &scale(), "PAR");
            let middle = picture.points[DRAWN_HEIGHT / 2 * WIDTH + WIDTH / 2];
            assert_eq!(middle, COLOURS[8]);
            assert_eq!(picture.points[0], [255; 3]);
        }
    }

    #[test]
    fn colours_are_those_of_the_page() {
        let script = include_str!("shaders.js");
        for [r, g, b] in COLOURS {
            assert!(script.contains(&format!("'#{r:02x}{g:02x}{b:02x}'")));
        }
        assert_eq!(colour(-1.0), COLOURS[0]);
        assert_eq!(colour(0.125), COLOURS[1]);
    }

    #[test]
    fn a_picture_reads_back_from_its_png() {
        let mut bytes = Vec::new();
        let picture = draw([].into_iter(), |_| 0.0, &scale(), "PAR");
        picture.write_png(&mut bytes).expect("written");
        let decoder = png::Decoder::new(io::Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a head");
        let mut points = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut points).expect("a picture");
        assert_eq!((info.width, info.height), (WIDTH as u32, HEIGHT as u32));
        assert!(points == picture.points.as_flattened());
    }
}
