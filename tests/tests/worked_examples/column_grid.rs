//! A new far-field grid: what lies beyond the sphere is told apart by where it is on the ground, too.

use std::sync::Arc;

use glam::DVec2;
use nestrad_common::canopy::Pattern;
use nestrad_engine::exchange::ThisProcess;
use nestrad_engine::frame::{Cut, Frame};
use nestrad_engine::plan::Plan;
use nestrad_engine::solution::Solution;
use nestrad_engine::traced::TracedCanopy;
use nestrad_kernel::far_grid::{FarGrid, InLayers, Levels, Passage, SharedFarGrid};
use nestrad_tests::solving::{finish, plan, sources, unwatched};

use super::{maize, within_a_sphere};

/// The pattern in columns, each with levels and polar bins of its own.
#[derive(Debug)]
struct Columns {
    pattern: Pattern,
    /// Number of columns along x and y.
    columns: [u32; 2],
    /// Of each column.
    levels: Levels,
}

impl Columns {
    /// The column that a place is in, or its copy in the pattern.
    fn column(&self, at_m: DVec2) -> u32 {
        let place = (at_m - self.pattern.min_m) / self.pattern.size_m;
        let [x, y] = [0, 1].map(|axis: usize| {
            let along = (place[axis] - place[axis].floor()) * f64::from(self.columns[axis]);
            // rounding may put it on the far edge
            (along as u32).min(self.columns[axis] - 1)
        });
        y * self.columns[0] + x
    }
}

impl FarGrid for Columns {
    fn len(&self) -> u32 {
        self.columns[0] * self.columns[1] * self.levels.len()
    }

    /// Column after column, each as [`Levels`] has it.
    fn end_at(&self, passage: &Passage<'_>) -> u32 {
        let column = self.column((passage.at_m)());
        column * self.levels.len() + self.levels.end_at(passage)
    }

    /// All columns begin with the same layers.
    fn layers(&self) -> [u32; 2] {
        self.levels.layers()
    }

    fn in_layers(&self, end: u32) -> InLayers {
        self.levels.in_layers(end % self.levels.len())
    }
}

/// The scene with another far-field grid than the planned one.
fn lit_with(grid: SharedFarGrid, plan: &Plan) -> Solution {
    let scene = maize();
    let cut = Cut {
        far: Some(grid),
        ..plan.trace.cut()
    };
    let frame = Frame::new(&scene.canopy, &cut).unwrap();
    let sources = sources(&scene, &plan.aims, plan.light.seed);
    unwatched(|run| {
        let traced =
            TracedCanopy::trace_frame(frame, &plan.trace, &ThisProcess::default(), run).unwrap();
        let lit = traced.lit(&scene.optics, &sources, &plan.light, run);
        lit.unwrap().0
    })
}

/// So many columns along x and y, with the levels and bins of a plan.
fn in_columns(columns: [u32; 2], plan: &Plan) -> Solution {
    let far = plan.trace.far_field.unwrap();
    let levels = Levels::new(far.levels, far.bins).unwrap();
    let pattern = maize().canopy.pattern.unwrap();
    let grid = Columns {
        pattern,
        columns,
        levels,
    };
    lit_with(Arc::new(grid), plan)
}

#[test]
fn one_column_gives_the_bits_of_levels() {
    let scene = maize();
    let plan = plan(&scene, &within_a_sphere());
    let by_levels = finish(&scene, &plan).unwrap().solution;
    assert!(by_levels == in_columns([1, 1], &plan));
}

#[test]
fn columns_take_nearly_the_same_light_as_levels() {
    let scene = maize();
    let plan = plan(&scene, &within_a_sphere());
    let by_levels = finish(&scene, &plan).unwrap().solution;
    let by_columns = in_columns([3, 2], &plan);
    assert!(by_levels.organs != by_columns.organs);
    let nir = 1;
    let [levels, columns] =
        [&by_levels, &by_columns].map(|s| s.balance[nir].absorbed_plants_W.value);
    let apart = (columns / levels - 1.0).abs();
    assert!(apart < 0.02, "{apart}");
}

#[test]
fn a_place_in_any_copy_of_the_pattern_is_in_the_same_column() {
    let grid = Columns {
        pattern: Pattern {
            min_m: DVec2::new(-1.0, 2.0),
            size_m: DVec2::new(0.5, 0.25),
        },
        columns: [3, 2],
        levels: Levels::new(5, 2).unwrap(),
    };
    let mut seen = [false; 6];
    for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
        let place = DVec2::new((f64::from(x) + 0.5) / 3.0, (f64::from(y) + 0.5) / 2.0);
        let of_copy = |copy: f64| {
            let at_m = grid.pattern.min_m + (place + copy) * grid.pattern.size_m;
            grid.column(at_m)
        };
        assert_eq!([of_copy(-7.0), of_copy(0.0), of_copy(4.0)], [y * 3 + x; 3]);
        seen[of_copy(0.0) as usize] = true;
    }
    assert_eq!(seen, [true; 6]);
}
