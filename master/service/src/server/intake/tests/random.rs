//! Whatever comes, nothing panics.

use nestrad_proto::v1;
use proptest::prelude::*;
use prost::Message;

use super::light::{band, sky, sun, surfaces};
use super::*;

/// Whatever comes is taken in or refused.
fn take_in(slices: Vec<v1::SceneSlice>) {
    use v1::scene_header::Geometry;
    use v1::scene_slice::Part;
    let mut upload: Option<Upload> = None;
    for part in slices.into_iter().filter_map(|slice| slice.part) {
        let fits = match (part, &mut upload) {
            (Part::Header(header), _) => {
                let _ = lighting(&header, &surfaces());
                if let Some(Geometry::NewGeometry(new)) = &header.geometry {
                    upload = Upload::begin(new).ok();
                }
                true
            }
            (Part::Organs(slice), Some(upload)) => upload.organs(slice).is_ok(),
            (Part::Triangles(slice), Some(upload)) => upload.triangles(&slice).is_ok(),
            _ => false,
        };
        if !fits {
            return;
        }
    }
    let _ = upload.map(Upload::finish);
}

fn slice(part: v1::scene_slice::Part) -> Vec<u8> {
    v1::SceneSlice { part: Some(part) }.encode_to_vec()
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(slice) = v1::SceneSlice::decode(&bytes[..]) {
            take_in(vec![slice]);
        }
        if let Ok(options) = v1::SolveOptions::decode(&bytes[..]) {
            let _ = settings(&options, 8.0);
        }
    }

    #[test]
    fn scenes_with_a_few_wrong_bytes_never_panic(
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        use v1::scene_slice::Part;
        let header = v1::SceneHeader {
            geometry: Some(v1::scene_header::Geometry::NewGeometry(header())),
            bands: vec![band("PAR")],
            sources: vec![sun()],
            sky: Some(sky()),
        };
        let mut messages = [
            slice(Part::Header(header)),
            slice(Part::Organs(organs())),
            slice(Part::Triangles(triangles())),
        ];
        for (at, byte) in wrong {
            let all: usize = messages.iter().map(Vec::len).sum();
            let mut at = at.index(all);
            for message in &mut messages {
                if at < message.len() {
                    message[at] = byte;
                    break;
                }
                at -= message.len();
            }
        }
        let decoded = messages.iter().map(|bytes| v1::SceneSlice::decode(&bytes[..]));
        if let Ok(slices) = decoded.collect() {
            take_in(slices);
        }
    }
}
