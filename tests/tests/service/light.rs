//! Light is refused and warned of as in files.

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, one_leaf, upload};
use nestrad_tests::processes::Master;

#[test]
fn a_beam_near_the_horizon_is_refused_or_warned_of() {
    let master = Master::start(&[]);
    block_on(async {
        let mut client = client(&master);
        let mut told = async |direction_z: f64| {
            let mut scene = one_leaf();
            if let Some(v1::scene_slice::Part::Header(header)) = &mut scene[0].part {
                header.sources[0].direction_x = 1.0;
                header.sources[0].direction_z = direction_z;
            }
            upload(&mut client, scene).await
        };
        let refused = told(-1e-5).await.unwrap_err();
        let message = "sources[0]: direction: expected a direction of travel that points down, 0.0057 degrees";
        assert!(
            refused.message().starts_with(message),
            "{}",
            refused.message()
        );
        let warnings = told(-0.01).await.unwrap().warnings;
        let warning = "band PAR: a source 0.57 degrees above the horizon has 10000 W m-2";
        assert!(
            warnings.iter().any(|w| w.starts_with(warning)),
            "{warnings:?}"
        );
        assert_eq!(told(-1.0).await.unwrap().warnings, [""; 0]);
    });
}
