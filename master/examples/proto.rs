use nestrad_common::assemble;
use nestrad_master::*;
use std::time::Instant;
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn main() {
    let arg: Vec<String> = std::env::args().collect();
    let get = |k: &str, d: f64| {
        arg.iter()
            .position(|a| a == k)
            .map_or(d, |i| arg[i + 1].parse().unwrap())
    };
    let name = &arg[1];
    let s = "/work/shared/scenes/";
    let toml = format!(
        "scene = \"{s}{name}.can.gz\"\npattern = \"{s}{name}.8\"\nsoil = {}\nlight = \"{s}clear.light\"\n[[bands]]\nname=\"PAR\"\noptics=\"{s}par.opt\"\n[[bands]]\nname=\"NIR\"\noptics=\"{s}nir.opt\"\n",
        if name == "maize_rows" { -0.002 } else { -0.01 }
    );
    std::fs::write("/tmp/proto.toml", toml).unwrap();
    let inputs = assemble::load_scene_file(std::path::Path::new("/tmp/proto.toml")).unwrap();
    let loaded = assemble::load(&inputs).unwrap();
    let p = &loaded.problem;
    let seed = get("--seed", 1.0) as u64;
    let mut mark = (Instant::now(), cpu());
    let mut lap = |what: &str| {
        eprintln!(
            "{what:12} wall {:.3} cpu {:.3}",
            mark.0.elapsed().as_secs_f64(),
            cpu() - mark.1
        );
        mark = (Instant::now(), cpu());
    };
    let start = cpu();
    let world = world::World::new(
        &p.scene,
        get("--edge", 0.05),
        0.05,
        get("--radius", f64::INFINITY),
        (0, 0),
    );
    lap("world");
    let areas = direct::spread_effort(p, get("--sun", 0.0024f64).powi(2));
    let d = direct::direct_light(p, &world, &areas, seed);
    lap("direct");
    let sampling = exchange::Sampling {
        batches: 16,
        axes: match get("--axes", 6.0) as u32 {
            6 => nestrad_common::directions::Axes::Icosahedron,
            10 => nestrad_common::directions::Axes::Dodecahedron,
            _ => nestrad_common::directions::Axes::Both,
        },
        sets_per_batch: get("--sets", 1.0) as u32,
        line_area_m2: get("--pitch", 0.004).powi(2),
        least_samples: get("--least", 4.0),
        seed,
    };
    let ex = exchange::trace_here(
        &p.scene,
        &world,
        &[exchange::BlockOf::whole(&world)],
        &sampling,
        || {},
    )
    .unwrap();
    lap("exchange");
    eprintln!("{:?} direct lines {}", ex.counters, d.lines);
    let bands = p.bands.len();
    let outlook = ex.outlook(&world);
    let mut fixed = vec![0.0; (world.ends.len() - world.rows()) * bands];
    let outer = (world.ends.outer_soil() as usize - world.rows()) * bands;
    fixed[outer] = 0.0;
    let scattering: Vec<usize> = (0..bands).collect();
    let irr = solver::solve(
        p,
        &world,
        &ex,
        &outlook,
        &d.irradiance_W_m2,
        &fixed,
        &scattering,
        &d.incoming_W,
        &solver::Tolerance {
            absorbed: get("--tol", 1e-4),
            most_passes: 100,
        },
    )
    .unwrap();
    lap("solve");
    eprintln!("passes {} left {:?}", irr.passes, irr.left);
    let sol = results::Parts {
        problem: p,
        world: &world,
        direct: &d,
        outlook: &outlook,
        irradiance: &irr,
        scattering: &scattering,
    }
    .assemble();
    lap("results");
    eprintln!("total cpu {:.3}", cpu() - start);
    let reference =
        std::fs::read_to_string(format!("/work/shared/reference/{name}.clear.organs.csv")).unwrap();
    let mut refs = std::collections::HashMap::new();
    for line in reference.lines().skip(1) {
        let f: Vec<&str> = line.split(',').collect();
        refs.insert(
            (f[0].to_string(), f[2].to_string()),
            (f[3].parse::<f64>().unwrap(), f[4].parse::<f64>().unwrap()),
        );
    }
    for (b, band) in p.bands.iter().enumerate() {
        let (mut e2, mut s2, mut a, mut m, mut se2, mut z2, mut n) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut zs = vec![];
        for (o, organ) in p.scene.organs.iter().enumerate() {
            let area = sol.organ_area_m2[o];
            if area < 1e-4 {
                continue;
            }
            let (r, s) = refs[&(organ.id.clone(), band.name.clone())];
            let item = &sol.organs[o * bands + b];
            let err = item.absorbed_W - r;
            e2 += err * err / area;
            s2 += s * s / area;
            a += area;
            m += r;
            se2 += item.absorbed_se_W.powi(2) / area;
            if arg.iter().any(|a| a == "-v") && (err / r).abs() > 0.02 {
                eprintln!(
                    "  {} {} area {area:.4} ref {r:.4} got {:.4} se {:.4} direct {:.4} Eu {:.2} El {:.2}",
                    organ.id,
                    band.name,
                    item.absorbed_W,
                    item.absorbed_se_W,
                    item.absorbed_direct_W,
                    item.irradiance_upper_W_m2,
                    item.irradiance_lower_W_m2
                );
            }
            let z = err / (s * s + item.absorbed_se_W.powi(2)).sqrt();
            z2 += z * z;
            n += 1.0;
            zs.push(z.abs());
        }
        zs.sort_by(f64::total_cmp);
        let mean = m / a;
        eprintln!(
            "{} organs {n}: rms {:.3} % (ref se {:.3} %) stated {:.3} %, rms z {:.2} median|z| {:.2}",
            band.name,
            100.0 * ((e2 - s2) / a).max(0.0).sqrt() / mean,
            100.0 * (s2 / a).sqrt() / mean,
            100.0 * (se2 / a).sqrt() / mean,
            (z2 / n).sqrt(),
            zs[zs.len() / 2]
        );
        eprintln!("{:?}", sol.balance[b]);
    }
}
