//! What a canopy holds, layer by layer.

use std::num::NonZeroUsize;

use glam::DVec3;
use nestrad_common::canopy::{Canopy, Pattern};
use nestrad_common::geometry;
use thiserror::Error;

/// A canopy as horizontal layers of equal thickness, numbered from the ground up.
///
/// Layer `k` lies between levels `k` and `k + 1`; level 0 is the soil plane or, where there is none,
/// the lowest point of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Height of level 0, metres, relative to the scene's local origin.
    pub bottom_z_m: f64,
    /// Height of the highest level, metres, not below `bottom_z_m`.
    pub top_z_m: f64,
    /// Area of ground that the foliage is counted on, m², positive.
    pub ground_area_m2: f64,
    /// Per inclination class, the cosine of the inclination (0 vertical, 1 horizontal leaves).
    pub class_cosine: Vec<f64>,
    /// What each layer holds, at least one layer.
    pub foliage: Vec<Vec<Foliage>>,
}

/// Leaves of one layer that are alike in inclination, facing and material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foliage {
    /// Index into [`Layers::class_cosine`].
    pub class: u32,
    /// Index into the materials of the canopy, and [`nestrad_common::optics::Band::materials`].
    pub material: u32,
    /// The right-hand normal points down: it is the lower face that looks up.
    pub lower_face_up: bool,
    /// One-sided area, m² per m² of ground, 0 to about 1e100.
    pub area_index: f64,
}

/// Why a scene has no layers.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum LayersFault {
    /// Area per m² of ground is not defined, or beyond all bounds.
    #[error(
        "a scene without a pattern needs an extent in both x and y for a far field; \
         give it a pattern or use --diameter inf"
    )]
    NoGround,
}

/// Beyond this, ground is as good as none: a leaf of 1 m² that stands on 1e-20 m².
const MAX_AREA_INDEX: f64 = 1e20;

impl Layers {
    /// Cuts triangles, each with its material, into `n_layers` layers, exactly where they cross a level.
    ///
    /// Inclinations, 0 to 90 degrees, are sorted into `inclination_classes` classes of equal width;
    /// a class is given the area-weighted mean cosine of what is in it. Ground is the pattern or, in
    /// an open scene, the bounding rectangle. What lies below the soil plane is left out.
    pub fn of(
        triangles: impl Iterator<Item = ([DVec3; 3], u32)> + Clone,
        (pattern, soil_z_m): (Option<Pattern>, Option<f64>),
        n_layers: NonZeroUsize,
        inclination_classes: NonZeroUsize,
    ) -> Result<Self, LayersFault> {
        let bounds = geometry::bounds_of(triangles.clone().map(|(corners, _)| corners));
        let ground_area_m2 = match (pattern, bounds) {
            (Some(pattern), _) => pattern.area_m2(),
            (None, Some((low, high))) => (high.x - low.x) * (high.y - low.y),
            (None, None) => 0.0,
        };
        if ground_area_m2.is_nan() || ground_area_m2 <= 0.0 {
            return Err(LayersFault::NoGround);
        }
        let (lowest, highest) = bounds.map_or((0.0, 0.0), |(low, high)| (low.z, high.z));
        let bottom = soil_z_m.unwrap_or(lowest);
        let top = bounds.map_or(bottom, |_| highest.max(bottom));
        let grid = Levels {
            bottom,
            top,
            n: n_layers.get(),
        };
        let mut sorter = Sorter::new(n_layers.get(), inclination_classes.get());
        for (triangle, material) in triangles {
            sorter.add(&grid, &triangle, material);
        }
        let (class_cosine, foliage) = sorter.finish(ground_area_m2);
        let layers = Self {
            bottom_z_m: grid.bottom,
            top_z_m: grid.top,
            ground_area_m2,
            class_cosine,
            foliage,
        };
        if layers.area_index() > MAX_AREA_INDEX {
            return Err(LayersFault::NoGround);
        }
        Ok(layers)
    }

    /// The layers of a canopy.
    pub fn of_canopy(
        canopy: &Canopy,
        n_layers: NonZeroUsize,
        inclination_classes: NonZeroUsize,
    ) -> Result<Self, LayersFault> {
        let triangles = canopy.triangles().map(|t| (t.corners_m, t.material));
        let ground = (canopy.pattern, canopy.soil_z_m);
        Self::of(triangles, ground, n_layers, inclination_classes)
    }

    /// One-sided area of all layers, m² per m² of ground.
    pub fn area_index(&self) -> f64 {
        self.foliage.iter().flatten().map(|f| f.area_index).sum()
    }
}

/// Heights of the levels.
struct Levels {
    bottom: f64,
    top: f64,
    n: usize,
}

impl Levels {
    fn z(&self, level: usize) -> f64 {
        self.bottom + (self.top - self.bottom) * (level as f64 / self.n as f64)
    }

    /// The layer that holds `z`; heights out of range go to the nearest layer, and a scene without
    /// height lies in layer 0.
    fn layer(&self, z: f64) -> usize {
        // The cast saturates and takes the 0 / 0 of a scene without height to 0.
        let layer = (z - self.bottom) / (self.top - self.bottom) * self.n as f64;
        (layer as usize).min(self.n - 1)
    }
}

/// Adds up area by class, facing and material on the one hand and layer on the other.
struct Sorter {
    classes: usize,
    layers: usize,
    /// Area and area times cosine per class.
    area: Vec<f64>,
    area_cosine: Vec<f64>,
    /// Area per layer of group `(material * classes + class) * 2 + lower_face_up`, if there is any.
    groups: Vec<Option<Vec<f64>>>,
}

impl Sorter {
    fn new(layers: usize, classes: usize) -> Self {
        Self {
            classes,
            layers,
            area: vec![0.0; classes],
            area_cosine: vec![0.0; classes],
            groups: Vec::new(),
        }
    }

    fn add(&mut self, grid: &Levels, triangle: &[DVec3; 3], material: u32) {
        let [a, b, c] = *triangle;
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let cut = Cut::new(triangle);
        let below_ground = cut.fraction_below(grid.bottom);
        let area = 0.5 * length;
        let kept = area * (1.0 - below_ground);
        let cosine = (normal.z.abs() / length).min(1.0);
        let class = (cosine.acos() / std::f64::consts::FRAC_PI_2 * self.classes as f64) as usize;
        let class = class.min(self.classes - 1);
        self.area[class] += kept;
        self.area_cosine[class] += kept * cosine;

        let group = (material as usize * self.classes + class) * 2 + usize::from(normal.z < 0.0);
        if self.groups.len() <= group {
            self.groups.resize(group + 1, None);
        }
        let layers = self.layers;
        let sums = self.groups[group].get_or_insert_with(|| vec![0.0; layers]);
        let (first, last) = (grid.layer(cut.z[0]), grid.layer(cut.z[2]));
        let mut below = below_ground;
        for (layer, sum) in sums.iter_mut().enumerate().take(last + 1).skip(first) {
            let above = if layer == last {
                1.0
            } else {
                cut.fraction_below(grid.z(layer + 1)).max(below)
            };
            *sum += area * (above - below);
            below = above;
        }
    }

    fn finish(self, ground_area_m2: f64) -> (Vec<f64>, Vec<Vec<Foliage>>) {
        let mut foliage = vec![Vec::new(); self.layers];
        for (group, sums) in self.groups.iter().enumerate() {
            for (layer, &area) in sums.iter().flatten().enumerate() {
                if area > 0.0 {
                    foliage[layer].push(Foliage {
                        class: (group / 2 % self.classes) as u32,
                        material: (group / 2 / self.classes) as u32,
                        lower_face_up: group % 2 == 1,
                        area_index: area / ground_area_m2,
                    });
                }
            }
        }
        let cosines = self.area.iter().zip(&self.area_cosine);
        let cosines = cosines.enumerate().map(|(class, (&area, &sum))| {
            if area > 0.0 {
                (sum / area).min(1.0)
            } else {
                let middle = (class as f64 + 0.5) / self.classes as f64;
                (middle * std::f64::consts::FRAC_PI_2).cos()
            }
        });
        (cosines.collect(), foliage)
    }
}

/// A triangle as horizontal planes see it: its vertex heights, sorted.
struct Cut {
    z: [f64; 3],
}

impl Cut {
    fn new(triangle: &[DVec3; 3]) -> Self {
        let mut z = triangle.map(|v| v.z);
        z.sort_by(f64::total_cmp);
        Self { z }
    }

    /// The share of the area that lies below the plane at `z`; a horizontal triangle in the plane
    /// counts as above it.
    fn fraction_below(&self, z: f64) -> f64 {
        let [low, middle, high] = self.z;
        if z <= low {
            0.0
        } else if z >= high {
            1.0
        } else if z < middle {
            ((z - low) / (middle - low)) * ((z - low) / (high - low))
        } else {
            1.0 - ((high - z) / (high - middle)) * ((high - z) / (high - low))
        }
    }
}
