//! A generated canopy as a folder that `nestrad solve` can be pointed at.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use super::canopy::Generated;
use super::drafts::{Drafts, is_own};
use super::error::WriteError;
use crate::light::sky::SkyError;
use crate::light::{CieType, Sky, SunnySky};

/// Typical of green leaves; upper and lower faces differ, as they do in nature.
const PAR_OPT: &str = "\
# photosynthetically active radiation: soil, then per species stem, leaf upper face (rho tau), \
leaf lower face (rho tau)
n 1
s d 0.15
e d 0.12   d 0.09 0.05   d 0.11 0.05
";
const NIR_OPT: &str = "\
# near infrared
n 1
s d 0.25
e d 0.50   d 0.44 0.45   d 0.46 0.44
";

/// Sky directions of `clear.light`, beside the sun.
const SKY_DIRECTIONS: NonZeroUsize = NonZeroUsize::MIN.saturating_add(45);

impl Generated {
    /// Writes `NAME.can`, the pattern `NAME.8`, `par.opt`, `nir.opt`, `clear.light` and a
    /// `scene.toml` that names them all, into `folder` (made if need be). `name` is a plain file
    /// name.
    ///
    /// Every number reads back as the very same number. All files are written beside their final
    /// names first and renamed when all are complete: a run that fails leaves no half-written file
    /// under a name that counts.
    ///
    /// A file that is in the way and is not, byte for byte, what this wrote there once is overwritten
    /// only where `overwrite` says so; else nothing is written at all.
    pub fn write(&self, folder: &Path, name: &str, overwrite: Overwrite) -> Result<(), WriteError> {
        let can = format!("{name}.can");
        let texts = [
            (format!("{name}.8"), self.pattern_text()),
            ("par.opt".to_owned(), PAR_OPT.to_owned()),
            ("nir.opt".to_owned(), NIR_OPT.to_owned()),
            ("clear.light".to_owned(), clear_light()?),
            ("scene.toml".to_owned(), self.scene_text(name)),
        ];
        if overwrite == Overwrite::Own {
            let names = texts.iter().map(|(file, _)| file).chain([&can]);
            refuse_foreign(names.map(|file| folder.join(file)))?;
        }
        let mut drafts = Drafts::begin(folder)?;
        drafts.add(&can, |out| self.write_can(out))?;
        for (file, text) in &texts {
            drafts.add(file, |out| out.write_all(text.as_bytes()))?;
        }
        drafts.publish()
    }

    fn write_can(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# made by nestrad generate; metres")?;
        for (label, triangle) in self.labels.iter().zip(&self.triangles) {
            write!(out, "p 1 {label} 3")?;
            for vertex in triangle {
                // the shortest decimal that reads back as the same number
                write!(out, " {} {} {}", vertex.x, vertex.y, vertex.z)?;
            }
            writeln!(out)?;
        }
        Ok(())
    }

    fn pattern_text(&self) -> String {
        let min = self.pattern.min_m;
        let max = min + self.pattern.size_m;
        format!("{} {}\n{} {}\n", min.x, min.y, max.x, max.y)
    }

    fn scene_text(&self, name: &str) -> String {
        format!(
            "# made by nestrad generate\n\
             scene = \"{name}.can\"\n\
             unit = \"m\"\n\
             pattern = \"{name}.8\"\n\
             soil = {:?}\n\
             light = \"clear.light\"\n\
             \n\
             [[bands]]\n\
             name = \"PAR\"\n\
             optics = \"par.opt\"\n\
             \n\
             [[bands]]\n\
             name = \"NIR\"\n\
             optics = \"nir.opt\"\n",
            self.soil_z_m
        )
    }
}

/// Which files may be overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// Those that were generated, and are as they were then.
    Own,
    /// All that have the names of new ones.
    All,
}

fn refuse_foreign(paths: impl Iterator<Item = PathBuf>) -> Result<(), WriteError> {
    for path in paths {
        match is_own(&path) {
            Ok(true) => {}
            Ok(false) => return Err(WriteError::Foreign { path }),
            Err(source) => return Err(WriteError::Io { path, source }),
        }
    }
    Ok(())
}

/// A summer morning at 45 degrees north: 500 W m⁻², a fifth of it from the sky.
fn clear_light() -> Result<String, SkyError> {
    let sky = Sky::Sunny {
        model: SunnySky::Cie(CieType::CLEAR),
        time_utc: "2024-06-21T10:00:00Z".to_owned(),
        latitude_deg: 45.0,
        longitude_deg: 0.0,
        diffuse_fraction: 0.2,
    };
    let light = sky.light(vec![500.0])?;
    let mut text = String::new();
    for source in light.sources(SKY_DIRECTIONS, 0).list {
        let [x, y, z] = source.direction.to_array();
        let irradiance: f64 = source.irradiance_W_m2.iter().sum();
        text.push_str(&format!("{irradiance} {x} {y} {z}\n"));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;

    use super::*;
    use crate::generate::{Bean, Maize};

    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entry = |entry: io::Result<fs::DirEntry>| {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, fs::read(&path).unwrap())
        };
        fs::read_dir(folder).unwrap().map(entry).collect()
    }

    #[test]
    fn one_seed_gives_the_same_bytes_and_another_does_not() {
        let written = |seed| {
            let folder = tempfile::tempdir().unwrap();
            let canopy = Bean {
                seed,
                ..Bean::default()
            };
            canopy
                .generate()
                .unwrap()
                .write(folder.path(), "bean", Overwrite::Own)
                .unwrap();
            files(folder.path())
        };
        let first = written(1);
        let names: Vec<_> = first.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "bean.8",
                "bean.can",
                "clear.light",
                "nir.opt",
                "par.opt",
                "scene.toml"
            ]
        );
        assert!(first == written(1));
        assert!(first["bean.can"] != written(2)["bean.can"]);
    }

    #[test]
    fn numbers_read_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let canopy = Maize::default().generate().unwrap();
        canopy
            .write(folder.path(), "maize", Overwrite::Own)
            .unwrap();
        let numbers = |name: &str| -> Vec<Vec<f64>> {
            let text = fs::read_to_string(folder.path().join(name)).unwrap();
            let line = |line: &str| {
                line.split(' ')
                    .filter_map(|word| word.parse().ok())
                    .collect()
            };
            text.lines()
                .filter(|l| !l.starts_with('#'))
                .map(line)
                .collect()
        };
        let polygons = numbers("maize.can");
        assert_eq!(polygons.len(), canopy.triangles.len());
        for ((read, triangle), label) in polygons.iter().zip(&canopy.triangles).zip(&canopy.labels)
        {
            // number of labels, the label, number of vertices, vertices
            assert_eq!(read[1], label.to_string().parse::<f64>().unwrap());
            let vertices: Vec<f64> = triangle.iter().flat_map(|v| v.to_array()).collect();
            assert_eq!(read[3..], vertices);
        }
        let pattern = canopy.pattern;
        let corners =
            [pattern.min_m, pattern.min_m + pattern.size_m].map(|c| c.to_array().to_vec());
        assert_eq!(numbers("maize.8"), corners);
        let light = numbers("clear.light");
        assert_eq!(light.len(), 47);
        let total: f64 = light.iter().map(|source| source[0]).sum();
        assert!((total - 500.0).abs() < 1e-10);
    }

    #[test]
    fn what_fails_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let canopy = Bean::default().generate().unwrap();
        fs::create_dir(folder.path().join("clear.light")).unwrap();
        for overwrite in [Overwrite::Own, Overwrite::All] {
            let error = canopy.write(folder.path(), "bean", overwrite);
            let error = error.unwrap_err().to_string();
            assert!(error.contains("clear.light"), "{error}");
            let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
            assert_eq!(left.len(), 1);
        }
    }

    /// Another canopy of the same names may take the place of one that nobody has touched.
    #[test]
    fn files_of_the_user_were_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let write = |seed, overwrite| {
            let bean = Bean {
                seed,
                ..Bean::default()
            };
            let canopy = bean.generate().unwrap();
            canopy.write(folder.path(), "bean", overwrite)
        };
        write(1, Overwrite::Own).unwrap();
        let first = files(folder.path());
        write(2, Overwrite::Own).unwrap();
        write(1, Overwrite::Own).unwrap();
        assert!(files(folder.path()) == first);

        for name in first.keys() {
            let path = folder.path().join(name);
            let own = &first[name];
            let mut bent = own.clone();
            bent[own.len() / 2] ^= 1;
            let more = [own, &b"# mine\n"[..]].concat();
            let less = &own[..own.iter().rposition(|&b| b == b'#').unwrap()];
            for foreign in [&b""[..], b"mine", less, &bent, &more, &own[1..]] {
                fs::write(&path, foreign).unwrap();
                let before = files(folder.path());
                let error = write(3, Overwrite::Own).unwrap_err().to_string();
                assert!(error.contains(name) && error.contains("--force"), "{error}");
                assert!(files(folder.path()) == before);
            }
            write(1, Overwrite::All).unwrap();
            assert!(files(folder.path()) == first);
        }
    }

    #[test]
    fn a_draft_took_the_place_of_a_file_of_the_user() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bean.can.partial");
        fs::write(&path, "mine").unwrap();
        let canopy = Bean::default().generate().unwrap();
        canopy.write(folder.path(), "bean", Overwrite::All).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"mine");
    }
}
