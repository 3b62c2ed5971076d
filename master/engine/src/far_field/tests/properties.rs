//! What must hold for any layers.

use nestrad_common::optics::FaceOptics;
use proptest::prelude::*;

use super::*;

/// Two faces that transmit alike, as all that obeys reciprocity does.
fn leaf() -> impl Strategy<Value = LeafOptics> {
    let tau = prop_oneof![Just(1.0), Just(0.0), 0.0..1.0];
    let share = || prop_oneof![Just(1.0), 0.0..1.0];
    (tau, share(), share()).prop_map(|(tau, upper, lower): (f64, f64, f64)| {
        let face = |share: f64| FaceOptics {
            rho: share * (1.0 - tau),
            tau,
        };
        LeafOptics {
            upper: face(upper),
            lower: face(lower),
        }
    })
}

fn band() -> impl Strategy<Value = Band> {
    (prop::collection::vec(leaf(), 2), 0.0..=1.0).prop_map(|(materials, soil_albedo)| Band {
        name: "any".into(),
        soil_albedo,
        materials,
    })
}

fn layers() -> impl Strategy<Value = Layers> {
    let area = prop_oneof![0.0..3.0, Just(0.0), Just(1e-9), 1e2..1e5];
    let foliage = (0..5_u32, 0..2_u32, any::<bool>(), area).prop_map(
        |(class, material, lower_face_up, area_index)| Foliage {
            class,
            material,
            lower_face_up,
            area_index,
        },
    );
    let layer = prop::collection::vec(foliage, 0..6);
    let cosine = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
    let cosines = prop::collection::vec(cosine, 5);
    (cosines, prop::collection::vec(layer, 1..8)).prop_map(|(class_cosine, foliage)| Layers {
        bottom_z_m: -1.0,
        top_z_m: 2.0,
        ground_area_m2: 1.0,
        class_cosine,
        foliage,
    })
}

fn sources() -> impl Strategy<Value = Vec<Source>> {
    let mu = prop_oneof![Just(1.0), Just(1e-6), 0.0001..1.0];
    prop::collection::vec((mu, 0.0..10.0).prop_map(|(mu, e)| source(mu, e)), 1..5)
}

fn run(layers: &Layers, band: &Band, sources: &[Source], bins: usize) -> Field {
    let soil = Some(band.soil_albedo);
    transport::solve(layers, band, 0, sources, soil, nonzero(bins))
}

/// What rounding is relative to. A vertical beam finds its way through vertical leaves however many
/// they are; what it becomes beneath them does not find it back, and is brighter than the beam.
fn brightness(field: &Field) -> f64 {
    let mut most = field.incoming_W_m2;
    for level in 0..field.levels() {
        for bin in 0..field.bins_per_hemisphere() {
            let brighter = field
                .radiance_up(level, bin)
                .max(field.radiance_down(level, bin));
            most = most.max(brighter);
        }
    }
    most
}

/// Level `k` of `a` is level `stride * k` of `b`.
fn same(a: &Field, b: &Field, stride: usize, tolerance: f64) {
    assert_eq!((a.levels() - 1) * stride, b.levels() - 1);
    let scale = brightness(a);
    close(a.reflected_W_m2, b.reflected_W_m2, tolerance * scale);
    close(a.transmitted_W_m2, b.transmitted_W_m2, tolerance * scale);
    for level in 0..a.levels() {
        for bin in 0..a.bins_per_hemisphere() {
            let (up, down) = (a.radiance_up(level, bin), a.radiance_down(level, bin));
            close(up, b.radiance_up(stride * level, bin), tolerance * scale);
            close(
                down,
                b.radiance_down(stride * level, bin),
                tolerance * scale,
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn energy_balances(
        layers in layers(), band in band(), sources in sources(), bins in 1_usize..9
    ) {
        let field = run(&layers, &band, &sources, bins);
        prop_assume!(field.incoming_W_m2 > 0.0);
        let missing = closure(&field, Some(band.soil_albedo)) * field.incoming_W_m2;
        close(missing, 0.0, 1e-13 * brightness(&field));
        prop_assert!(field.absorbed_W_m2.iter().all(|a| *a >= 0.0));
    }

    #[test]
    fn a_leaf_turned_over_is_one_with_its_faces_swapped(
        layers in layers(), band in band(), sources in sources()
    ) {
        let mut turned = layers.clone();
        for f in turned.foliage.iter_mut().flatten() {
            f.lower_face_up = !f.lower_face_up;
        }
        let mut swapped = band.clone();
        for leaf in &mut swapped.materials {
            std::mem::swap(&mut leaf.upper, &mut leaf.lower);
        }
        let a = run(&layers, &band, &sources, 4);
        prop_assert_eq!(a, run(&turned, &swapped, &sources, 4));
    }

    #[test]
    fn a_layer_cut_in_two_is_the_same_layer(
        layers in layers(), band in band(), sources in sources()
    ) {
        let mut halved = layers.clone();
        halved.foliage = layers
            .foliage
            .iter()
            .flat_map(|layer| {
                let mut half = layer.clone();
                half.iter_mut().for_each(|f| f.area_index *= 0.5);
                [half.clone(), half]
            })
            .collect();
        let whole = run(&layers, &band, &sources, 5);
        same(&whole, &run(&halved, &band, &sources, 5), 2, 1e-9);
    }

    #[test]
    fn sources_add_up(layers in layers(), band in band(), sources in sources()) {
        let all = run(&layers, &band, &sources, 3);
        let one_by_one = sources.iter().map(|s| run(&layers, &band, std::slice::from_ref(s), 3));
        let sum: f64 = one_by_one.map(|f| f.radiance_up(1, 1)).sum();
        close(all.radiance_up(1, 1), sum, 1e-12 * brightness(&all));
    }
}
