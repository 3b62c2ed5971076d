//! The canopy as a picture for print: seen from aside without perspective, as the page shows it first.

use std::io::Write;

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use glam::{DVec2, DVec3};

use super::letters::letter;
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
const LETTER_DOT: usize = 4;

/// A picture of red, green and blue.
#[derive(Debug)]
pub(crate) struct Picture {
    points: Vec<[u8; 3]>,
}

/// Draws triangles, each with a value of 0 to 1, over a colour bar that goes to `top` and is for `what`.
pub(crate) fn draw(
    triangles: impl Iterator<Item = [DVec3; 3]> + Clone,
    value: impl Fn(usize) -> f64,
    top: f64,
    what: &str,
) -> Picture {
    let mut picture = Picture {
        points: vec![[255; 3]; WIDTH * HEIGHT],
    };
    picture.canopy(triangles, value);
    picture.bar(top, what);
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

    fn bar(&mut self, top: f64, what: &str) {
        let (left, length, upper, thick) = (200, WIDTH - 400, DRAWN_HEIGHT + 20, 40);
        for x in 0..length {
            let own = colour(x as f64 / (length - 1) as f64);
            for y in upper..upper + thick {
                self.points[y * WIDTH + left + x] = own;
            }
        }
        let line = upper + thick + 12;
        self.write("0", left, line);
        // three digits that mean something
        let decimals = (2.0 - top.max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
        self.write(&format!("{top:.decimals$}"), left + length, line);
        self.write(&format!("{what} W m-2"), left + length / 2, line);
    }

    /// Text around a place.
    fn write(&mut self, text: &str, middle: usize, upper: usize) {
        let step = 6 * LETTER_DOT;
        // a long name is cut, not drawn over the edge
        let text: Vec<char> = text.chars().take(40).collect();
        let left = middle.saturating_sub(text.len() * step / 2);
        for (k, &character) in text.iter().enumerate() {
            for (column, dots) in letter(character).into_iter().enumerate() {
                for row in (0..7).filter(|row| dots >> row & 1 == 1) {
                    self.dot(
                        left + k * step + column * LETTER_DOT,
                        upper + row * LETTER_DOT,
                    );
                }
            }
        }
    }

    fn dot(&mut self, left: usize, upper: usize) {
        for y in upper..(upper + LETTER_DOT).min(HEIGHT) {
            for x in left..(left + LETTER_DOT).min(WIDTH) {
                self.points[y * WIDTH + x] = [0; 3];
            }
        }
    }

    /// Writes the picture as PNG: a head, one stream of rows, an end.
    pub(crate) fn write_png(&self, out: &mut impl Write) -> Result<(), Fault> {
        out.write_all(b"\x89PNG\r\n\x1a\n")?;
        let mut head = Vec::new();
        for size in [WIDTH, HEIGHT] {
            head.extend((size as u32).to_be_bytes());
        }
        // eight bits of red, green and blue; the only ways of compressing and filtering; row after row
        head.extend([8, 2, 0, 0, 0]);
        chunk(*b"IHDR", &head, out)?;
        let mut rows = ZlibEncoder::new(Vec::new(), Compression::default());
        for row in self.points.chunks(WIDTH) {
            // rows as they are
            rows.write_all(&[0])?;
            rows.write_all(row.as_flattened())?;
        }
        chunk(*b"IDAT", &rows.finish()?, out)?;
        chunk(*b"IEND", &[], out)
    }
}

fn chunk(name: [u8; 4], data: &[u8], out: &mut impl Write) -> Result<(), Fault> {
    let mut check = Crc::new();
    check.update(&name);
    check.update(data);
    out.write_all(&(data.len() as u32).to_be_bytes())?;
    out.write_all(&name)?;
    out.write_all(data)?;
    Ok(out.write_all(&check.sum().to_be_bytes())?)
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

    #[test]
    fn the_nearer_triangle_is_seen() {
        let [right, up, eye] = axes();
        let at = |depth: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| right * x + up * y + eye * depth)
        };
        for triangles in [[at(0.0), at(1.0)], [at(1.0), at(0.0)]] {
            let nearer = usize::from(triangles[0] == at(0.0));
            let value = |t: usize| if t == nearer { 1.0 } else { 0.0 };
            let picture = draw(triangles.into_iter(), value, 1.0, "PAR");
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
    fn a_picture_is_a_png() {
        let mut out = Vec::new();
        let picture = draw(
            [].into_iter(),
            |_| 0.0,
            1.0,
            "a name that is far too long for the picture it is on",
        );
        picture.write_png(&mut out).expect("written");
        assert!(out.starts_with(b"\x89PNG"));
    }
}
