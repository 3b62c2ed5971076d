//! A result as a page to look at: the canopy in 3D, coloured by the light that it absorbs, with
//! profiles, the balance and the errors. See [`write()`].

mod data;
mod error;
mod page;
mod picture;
pub mod profile;
mod record;
mod scale;
mod table;

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use nestrad_common::assemble::load_canopy;
use nestrad_common::canopy::Canopy;
use nestrad_common::geometry;
use nestrad_common::inputs::Inputs;
use nestrad_engine::solution::{Balance, BandAccount};
use serde::Serialize;

pub use self::error::ReportError;

use self::data::{Organ, Results, Soil, SpreadFacts};
use self::page::Blob;
use self::profile::{LIT_STEP, Layer, Patch};
use self::scale::Scale;
use crate::atomic::{Staging, check_writable};
use crate::error::OutputError;
use crate::folder::REPORT;

/// Layers of the vertical profile.
const LAYERS: usize = 20;
/// Triangles whose areas differ by more, relatively, are not the same: tables have nine digits.
const SAME_AREA: f64 = 1e-6;

/// What to make a report of.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// Folder of results; the report becomes `report.html` in it.
    pub out: &'a Path,
    /// The canopy; `None` where it still is where the summary says.
    pub scene: Option<Inputs>,
    /// A canopy of more triangles is not drawn.
    pub most_triangles: usize,
    /// A picture of the canopy, if it is wanted.
    pub picture: Option<PictureRequest<'a>>,
}

/// A picture beside the page.
#[derive(Clone, Debug)]
pub struct PictureRequest<'a> {
    /// Where it is written, as PNG.
    pub path: &'a Path,
    /// The band that colours it; `None` for the first.
    pub band: Option<&'a str>,
}

/// A report that was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// The page.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Why the canopy is not drawn, if it is not.
    pub not_drawn: Option<String>,
}

/// All that the page shows, but for what there is of each triangle.
#[derive(Serialize)]
struct Facts<'a> {
    title: &'a str,
    version: &'a str,
    bands: &'a [String],
    light: &'a str,
    sources: usize,
    accuracy_percent: f64,
    seed: u64,
    plants: usize,
    area_index: Option<f64>,
    periodic: bool,
    /// Of the pattern, or of the box around a scene that stands alone: what `area_index` and the profiles
    /// are per area of.
    ground_m: [f64; 2],
    resources: &'a serde_json::Value,
    balance: &'a [Balance],
    errors: &'a [SpreadFacts],
    /// What they come from, of bands in which anything is absorbed.
    account: &'a [BandAccount],
    reasons: &'a [String],
    organs: &'a [Organ],
    layers: &'a [Layer],
    lit_step: f64,
    /// Per band.
    scales: Vec<Scales<'a>>,
    triangles: usize,
    not_drawn: Option<&'a str>,
    /// Subtracted from all coordinates of the drawing.
    origin_m: [f64; 3],
    soil: Option<&'a Soil>,
    soil_z_m: Option<f64>,
}

/// The colour scales of a band.
#[derive(Serialize)]
struct Scales<'a> {
    /// Of triangles.
    triangle: &'a Scale,
    /// Of the means of organs, which are less far apart.
    organ: Scale,
}

/// Reads a folder of results and writes a page into it.
pub fn write(request: &Request<'_>) -> Result<Written, ReportError> {
    // before the work, not after it
    check_writable(request.out, &[REPORT])?;
    if let Some(picture) = &request.picture {
        let (folder, name) = place_of(picture.path);
        check_writable(folder, &[&name])?;
    }
    let results = data::read(request.out)?;
    let canopy = canopy(request, &results)?;
    let picture = request.picture.as_ref();
    let picture = picture
        .map(|picture| Ok::<_, ReportError>((picture.path, band(request.out, &results, picture)?)))
        .transpose()?;
    let path = request.out.join(REPORT);
    let most = request.most_triangles;
    let triangles = canopy.len();
    let not_drawn = (triangles > most).then(|| {
        format!(
            "the canopy is not drawn: it has {triangles} triangles, more than --most-triangles {most}"
        )
    });

    let patches = patches(&canopy, &results);
    let summary = &results.summary;
    let scales: Vec<Scale> = (0..results.bands.len())
        .map(|band| {
            let values = patches.iter();
            Scale::of(values.map(|p| (p.light[band].absorbed_W_m2, p.area_m2)))
        })
        .collect();
    if let Some((path, band)) = picture {
        write_picture(path, &canopy, &results, band, &scales[band])?;
    }
    let plants = plants(&results);
    let title = title(&summary.options.scenes);
    let facts = Facts {
        title: &title,
        version: &summary.version,
        bands: &results.bands,
        light: &summary.options.light,
        sources: summary.options.sources,
        accuracy_percent: summary.options.accuracy_percent,
        seed: summary.options.seed,
        plants: summary.scene.plants,
        area_index: summary.scene.area_index,
        periodic: summary.scene.pattern_m.is_some(),
        ground_m: summary.scene.ground_m(),
        resources: &summary.resources,
        balance: &summary.energy_balance,
        errors: &summary.error_estimates,
        account: summary.plan.accuracy.as_ref().map_or(&[], |a| &a.errors),
        reasons: &summary.plan.reasons,
        organs: &results.organs,
        layers: &profile::layers(&patches, &summary.above_W_m2(), LAYERS),
        lit_step: LIT_STEP,
        scales: (0..)
            .zip(&scales)
            .map(|(band, triangle)| Scales {
                triangle,
                organ: organ_scale(&results.organs, &plants, band),
            })
            .collect(),
        triangles,
        not_drawn: not_drawn.as_deref(),
        origin_m: canopy.origin_m.to_array(),
        soil: results.soil.as_ref(),
        soil_z_m: summary.scene.soil_z_m,
    };
    let blobs = match not_drawn {
        None => blobs(&canopy, &results),
        Some(_) => Vec::new(),
    };
    let mut staging = Staging::begin(request.out)?;
    staging.write(REPORT, |out| page::write(&title, &facts, &blobs, out))?;
    staging.commit(REPORT, &[])?;
    let size = fs::metadata(&path).map_err(|error| OutputError::at(&path, error))?;
    Ok(Written {
        bytes: size.len(),
        path,
        not_drawn,
    })
}

/// The number of the band that colours a picture.
fn band(out: &Path, results: &Results, picture: &PictureRequest<'_>) -> Result<usize, ReportError> {
    let Some(name) = picture.band else {
        return Ok(0);
    };
    let found = results.bands.iter().position(|band| band == name);
    found.ok_or_else(|| ReportError::Band {
        out: out.to_owned(),
        bands: results.bands.join(", "),
        found: name.to_owned(),
    })
}

fn write_picture(
    path: &Path,
    canopy: &Canopy,
    results: &Results,
    band: usize,
    scale: &Scale,
) -> Result<(), ReportError> {
    let bands = results.bands.len();
    let value = |t: usize| scale.part(results.triangles.light[t * bands + band].absorbed_W_m2);
    let picture = picture::draw(canopy.corners_m(), value, scale, &results.bands[band]);
    let (folder, name) = place_of(path);
    let mut staging = Staging::begin(folder)?;
    staging.write(&name, |out| picture.write_png(out))?;
    Ok(staging.commit(&name, &[])?)
}

/// Folder and name of a file that is to be written.
fn place_of(path: &Path) -> (&Path, Cow<'_, str>) {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = path.file_name().unwrap_or_default();
    (folder, name.to_string_lossy())
}

/// The canopy, which must be the one that was solved.
fn canopy(request: &Request<'_>, results: &Results) -> Result<Canopy, ReportError> {
    let options = &results.summary.options;
    let solved = Inputs {
        scenes: options.scenes.iter().map(PathBuf::from).collect(),
        unit: Some(options.unit),
        up: Some(options.up),
        ..Inputs::default()
    };
    let inputs = match &request.scene {
        Some(given) => given.clone().over(solved),
        None => solved,
    };
    let canopy = load_canopy(&inputs).map_err(ReportError::Scene)?;
    match difference(&canopy, results) {
        None => Ok(canopy),
        Some(what) => Err(ReportError::OtherScene {
            scene: {
                let paths = inputs.scenes.iter().map(|p| p.display().to_string());
                paths.collect::<Vec<_>>().join(", ")
            },
            out: request.out.to_owned(),
            what,
        }),
    }
}

/// What tells the canopy from the one that was solved.
fn difference(canopy: &Canopy, results: &Results) -> Option<String> {
    let (found, expected) = (canopy.len(), results.triangles.area_m2.len());
    if found != expected {
        return Some(format!("it has {found} triangles, the results {expected}"));
    }
    canopy.triangles().enumerate().find_map(|(t, triangle)| {
        let own = &canopy.organs[triangle.organ as usize];
        let organ = &results.organs[results.triangles.organ[t] as usize];
        if (&own.plant, &own.id) != (&organ.plant, &organ.organ) {
            let (own, other) = (&own.id, &organ.organ);
            return Some(format!(
                "triangle {t} is of organ {own}, in the results of {other}"
            ));
        }
        let own = geometry::area(&triangle.corners_m);
        let other = results.triangles.area_m2[t];
        // a triangle without area has none in the results
        let differs = other > 0.0 && (own - other).abs() > SAME_AREA * own.max(other);
        differs.then(|| format!("triangle {t} has {own:e} m², in the results {other:e} m²"))
    })
}

/// The names of the files, without where they are.
fn title(scenes: &[String]) -> String {
    let name = |scene: &String| {
        let name = Path::new(scene).file_name();
        name.map_or_else(|| scene.clone(), |name| name.to_string_lossy().into_owned())
    };
    scenes.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Whether each organ is of a plant: some of it is leaf or stem.
fn plants(results: &Results) -> Vec<bool> {
    let mut plants = vec![false; results.organs.len()];
    let of_triangles = results.triangles.organ.iter().zip(&results.triangles.plant);
    for (&organ, &plant) in of_triangles {
        plants[organ as usize] |= plant;
    }
    plants
}

/// The scale of what organs absorb per area of their own.
fn organ_scale(organs: &[Organ], plants: &[bool], band: usize) -> Scale {
    let shown = organs.iter().zip(plants);
    let shown = shown.filter(|(organ, plant)| **plant && organ.area_m2 > 0.0);
    Scale::of(shown.map(|(organ, _)| {
        let absorbed_W_m2 = organ.light[band].absorbed_W / organ.area_m2;
        (absorbed_W_m2, organ.area_m2)
    }))
}

/// All triangles of plants.
fn patches(canopy: &Canopy, results: &Results) -> Vec<Patch> {
    let bands = results.bands.len();
    let numbered = canopy.triangles().enumerate();
    numbered
        .filter(|&(t, _)| results.triangles.plant[t])
        .map(|(t, triangle)| Patch {
            z_m: triangle.corners_m.iter().map(|v| v.z).sum::<f64>() / 3.0 + canopy.origin_m.z,
            area_m2: results.triangles.area_m2[t],
            light: results.triangles.light[t * bands..(t + 1) * bands].to_vec(),
        })
        .collect()
}

/// Vertices, organs, and absorbed light per band: f32, u32, f32.
fn blobs(canopy: &Canopy, results: &Results) -> Vec<Blob> {
    let bands = results.bands.len();
    let vertices = canopy.corners_m().flatten();
    let coordinates = vertices.flat_map(|vertex| vertex.as_vec3().to_array());
    let mut blobs = vec![
        Blob {
            name: "vertices".to_owned(),
            bytes: coordinates.flat_map(f32::to_le_bytes).collect(),
        },
        Blob {
            name: "organs".to_owned(),
            bytes: results
                .triangles
                .organ
                .iter()
                .flat_map(|organ| organ.to_le_bytes())
                .collect(),
        },
    ];
    for band in 0..bands {
        let light = results.triangles.light.iter().skip(band).step_by(bands);
        blobs.push(Blob {
            name: format!("absorbed-{band}"),
            bytes: light
                .flat_map(|light| (light.absorbed_W_m2 as f32).to_le_bytes())
                .collect(),
        });
    }
    blobs
}
