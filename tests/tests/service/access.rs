//! Who is let in: tokens, certificates, and where a master may listen.

use std::fs;

use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::v1;
use nestrad_proto::v1::worker_service_client::WorkerServiceClient;
use nestrad_tests::calls::block_on;
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, finish, program, said};
use nestrad_tests::rogue::honest_join;
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair, KeyUsagePurpose};
use tonic::Code;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;

const CLIENT: &str = "token-of-the-clients-1";
const WORKER: &str = "token-of-the-workers-1";

/// What a call of the client service comes to, and one of the health service.
fn codes(url: &str, credentials: &Credentials) -> (Option<Code>, Option<Code>) {
    block_on(async {
        let channel = connect(url, credentials).unwrap();
        let mut client = nestrad_service::client::client(channel.clone());
        let status = client.status(v1::StatusRequest {}).await;
        let health = HealthClient::new(channel)
            .check(HealthCheckRequest::default())
            .await;
        (
            status.err().map(|e| e.code()),
            health.err().map(|e| e.code()),
        )
    })
}

#[test]
fn tokens_open_one_service_each_and_are_never_logged() {
    let desk = Desk::new();
    for (name, token) in [
        ("client", CLIENT),
        ("worker", WORKER),
        ("wrong", "token-of-nobody-at-all"),
    ] {
        fs::write(desk.path(name), token).unwrap();
    }
    let path = |name: &str| desk.path(name).display().to_string();
    let (client, worker) = (path("client"), path("worker"));
    let master = Master::start(&["--client-token", &client, "--worker-token", &worker]);
    let with = |name: &str| Credentials {
        token_file: Some(desk.path(name)),
        ..Credentials::default()
    };
    let url = master.url();
    assert_eq!(codes(&url, &with("client")), (None, None));
    assert_eq!(
        codes(&url, &with("worker")),
        (Some(Code::PermissionDenied), None)
    );
    assert_eq!(
        codes(&url, &with("wrong")),
        (Some(Code::Unauthenticated), None)
    );
    assert_eq!(
        codes(&url, &Credentials::default()),
        (Some(Code::Unauthenticated), None)
    );

    let solve = ["solve", "scene.toml", "--out", "out", "--master", &url];
    let refused = desk.run(&solve);
    assert_eq!(refused.status.code(), Some(5));
    assert!(
        said(&refused).contains("expected a bearer token"),
        "{}",
        said(&refused)
    );
    let let_in = desk.done(&[&solve[..], &["--token-file", "client"]].concat());
    let from_variable = nestrad_tests::processes::nestrad(desk.folder(), &solve)
        .env("NESTRAD_TOKEN", CLIENT)
        .output()
        .unwrap();
    assert!(from_variable.status.success(), "{}", said(&from_variable));
    for text in [
        master.log(),
        said(&refused),
        said(&let_in),
        master.metrics_text(),
    ] {
        assert!(!text.contains("token-of"), "{text}");
    }
}

/// A certificate authority, and certificates of it in files.
struct Authority {
    issuer: Issuer<'static, KeyPair>,
}

impl Authority {
    fn new(desk: &Desk, name: &str) -> Self {
        let mut params = CertificateParams::default();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let key = KeyPair::generate().unwrap();
        let certificate = params.self_signed(&key).unwrap();
        fs::write(desk.path(&format!("{name}.pem")), certificate.pem()).unwrap();
        Self {
            issuer: Issuer::new(params, key),
        }
    }

    /// Writes NAME.pem and NAME.key for a host.
    fn certify(&self, desk: &Desk, name: &str) {
        let names = vec!["127.0.0.1".to_owned(), "localhost".to_owned()];
        let key = KeyPair::generate().unwrap();
        let params = CertificateParams::new(names).unwrap();
        let certificate = params.signed_by(&key, &self.issuer).unwrap();
        fs::write(desk.path(&format!("{name}.pem")), certificate.pem()).unwrap();
        fs::write(desk.path(&format!("{name}.key")), key.serialize_pem()).unwrap();
    }
}

#[test]
fn certificates_prove_the_master_and_its_callers() {
    let desk = Desk::new();
    let ours = Authority::new(&desk, "ca");
    ours.certify(&desk, "master");
    ours.certify(&desk, "client");
    let others = Authority::new(&desk, "other-ca");
    others.certify(&desk, "stranger");
    let path = |name: &str| desk.path(name).display().to_string();
    let (cert, key, ca) = (path("master.pem"), path("master.key"), path("ca.pem"));
    let tls = ["--tls-cert", &cert, "--tls-key", &key];
    let with = |ca: &str, identity: Option<&str>| Credentials {
        ca: Some(desk.path(ca)),
        cert: identity.map(|name| desk.path(&format!("{name}.pem"))),
        key: identity.map(|name| desk.path(&format!("{name}.key"))),
        token_file: None,
    };

    let master = Master::start(&tls);
    let url = format!("https://{}", master.address);
    assert_eq!(codes(&url, &with("ca.pem", None)), (None, None));
    let localhost = format!("https://localhost:{}", master.address.port());
    assert_eq!(codes(&localhost, &with("ca.pem", None)), (None, None));
    // a master of another authority is not believed, and one with TLS does not speak without
    for (url, credentials) in [
        (&url, with("other-ca.pem", None)),
        (&master.url(), Credentials::default()),
    ] {
        let (status, health) = codes(url, &credentials);
        assert!(status.is_some() && health.is_some(), "{url}");
    }

    let master = Master::start(&[&tls[..], &["--client-ca", &ca]].concat());
    let url = format!("https://{}", master.address);
    assert_eq!(codes(&url, &with("ca.pem", Some("client"))), (None, None));
    let anonymous = codes(&url, &with("ca.pem", None));
    assert_eq!(anonymous, (Some(Code::Unauthenticated), None));
    let (status, _) = codes(&url, &with("ca.pem", Some("stranger")));
    assert!(status.is_some());
    let args = [
        "solve",
        "scene.toml",
        "--out",
        "there",
        "--master",
        &url,
        "--ca",
        "ca.pem",
    ];
    desk.done(&[&args[..], &["--cert", "client.pem", "--key", "client.key"]].concat());
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    assert!(desk.tables("here") == desk.tables("there"));
}

#[test]
fn a_certificate_that_is_refused_is_said_to_client_and_worker() {
    let desk = Desk::new();
    let ours = Authority::new(&desk, "ca");
    ours.certify(&desk, "master");
    let others = Authority::new(&desk, "other-ca");
    others.certify(&desk, "stranger");
    let path = |name: &str| desk.path(name).display().to_string();
    let (cert, key, ca) = (path("master.pem"), path("master.key"), path("ca.pem"));
    let tls = ["--tls-cert", &cert, "--tls-key", &key, "--client-ca", &ca];
    let master = Master::start(&tls);
    let url = format!("https://{}", master.address);
    let begun = std::time::Instant::now();
    let stranger = ["--cert", "stranger.pem", "--key", "stranger.key"];
    let solve = ["solve", "scene.toml", "--out", "out", "--master", &url];
    let status = ["status", "--master", &url];
    let worker = ["--master", &url];
    for ca in ["ca.pem", "other-ca.pem"] {
        let expected = match ca {
            "ca.pem" => "the master refuses the certificate of this caller (--cert)",
            _ => "the certificate of the master is not trusted (--ca)",
        };
        let with = [&["--ca", ca][..], &stranger].concat();
        let mut joins = std::process::Command::new(program("nestrad-worker"));
        joins
            .args([&worker[..], &with].concat())
            .current_dir(desk.folder());
        joins.stderr(std::process::Stdio::piped());
        for output in [
            desk.run(&[&solve[..], &with].concat()),
            desk.run(&[&status[..], &with].concat()),
            finish(joins),
        ] {
            assert!(!output.status.success());
            assert!(said(&output).contains(expected), "{}", said(&output));
        }
    }
    // nobody tries again what cannot succeed
    assert!(begun.elapsed() < std::time::Duration::from_secs(30));
}

#[test]
fn one_token_does_not_stand_for_clients_and_workers() {
    let desk = Desk::new();
    fs::write(desk.path("token"), CLIENT).unwrap();
    let here = ["serve", "--listen", "127.0.0.1:0"];
    let tokens = ["--client-token", "token", "--worker-token", "token"];
    let output = desk.run(&[&here[..], &tokens].concat());
    assert_eq!(output.status.code(), Some(1));
    let said = said(&output);
    assert!(said.contains("expected two tokens"), "{said}");
    assert!(!said.contains("serves") && !said.contains(CLIENT), "{said}");
}

/// What a worker comes to that joins.
fn joining(url: &str, credentials: &Credentials) -> Option<Code> {
    block_on(async {
        let mut client = WorkerServiceClient::new(connect(url, credentials).unwrap());
        let joined = client.join(honest_join()).await;
        joined.err().map(|e| e.code())
    })
}

#[test]
fn a_certificate_of_clients_opens_nothing_to_workers_nor_the_other_way_round() {
    let desk = Desk::new();
    let clients = Authority::new(&desk, "ca");
    clients.certify(&desk, "master");
    clients.certify(&desk, "client");
    Authority::new(&desk, "worker-ca").certify(&desk, "worker");
    let path = |name: &str| desk.path(name).display().to_string();
    let (cert, key) = (path("master.pem"), path("master.key"));
    let (client_ca, worker_ca) = (path("ca.pem"), path("worker-ca.pem"));
    let tls = ["--tls-cert", &cert, "--tls-key", &key];
    let as_one = |name: &str| Credentials {
        ca: Some(desk.path("ca.pem")),
        cert: Some(desk.path(&format!("{name}.pem"))),
        key: Some(desk.path(&format!("{name}.key"))),
        token_file: None,
    };
    let (client, worker) = (as_one("client"), as_one("worker"));
    let denied = Some(Code::PermissionDenied);

    let both = ["--client-ca", &client_ca, "--worker-ca", &worker_ca];
    let master = Master::start(&[tls, both].concat());
    let url = format!("https://{}", master.address);
    assert_eq!(codes(&url, &client), (None, None));
    assert_eq!(joining(&url, &worker), None);
    assert_eq!(codes(&url, &worker), (denied, None));
    assert_eq!(joining(&url, &client), denied);

    // without an authority of the workers there are no workers
    let master = Master::start(&[&tls[..], &["--client-ca", &client_ca]].concat());
    let url = format!("https://{}", master.address);
    assert_eq!(codes(&url, &client), (None, None));
    assert_eq!(joining(&url, &client), denied);
}

#[test]
fn other_machines_are_not_served_without_encryption_and_credentials() {
    let desk = Desk::new();
    fs::write(desk.path("token"), CLIENT).unwrap();
    for (more, expected) in [
        (&[][..], "--tls-cert and --tls-key, or --allow-plaintext"),
        (
            &["--client-token", "token"],
            "--tls-cert and --tls-key, or --allow-plaintext",
        ),
        (
            &["--allow-plaintext"],
            "--client-token and --worker-token, or --client-ca and --worker-ca",
        ),
    ] {
        let output = desk.run(&[&["serve", "--listen", "0.0.0.0:0"], more].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(
            said(&output).contains(expected),
            "{more:?}: {}",
            said(&output)
        );
        assert!(!said(&output).contains("serves"));
    }
}
