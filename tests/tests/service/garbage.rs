//! Bytes that mean nothing, and messages that are too large: refused, and the master goes on.

use bytes::{Buf, BufMut, Bytes};
use http::uri::PathAndQuery;
use nestrad_proto::channel::{Authorized, Credentials, connect};
use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client};
use nestrad_tests::processes::Master;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::{Request, Status};

const METHODS: [&str; 7] = [
    "UploadScene",
    "StartSolve",
    "WatchSolve",
    "FetchResults",
    "CancelSolve",
    "ListSolves",
    "Status",
];

/// Messages as they are.
#[derive(Clone, Copy, Default)]
struct Raw;

impl Codec for Raw {
    type Encode = Bytes;
    type Decode = Bytes;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, item: Bytes, into: &mut EncodeBuf<'_>) -> Result<(), Status> {
        into.put(item);
        Ok(())
    }
}

impl Decoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn decode(&mut self, from: &mut DecodeBuf<'_>) -> Result<Option<Bytes>, Status> {
        Ok(Some(from.copy_to_bytes(from.remaining())))
    }
}

/// Sends messages to a method, and takes all that it answers.
async fn send(channel: Authorized, method: &str, messages: Vec<Bytes>) -> Result<(), Status> {
    let mut grpc = tonic::client::Grpc::new(channel);
    grpc.ready()
        .await
        .map_err(|e| Status::unknown(e.to_string()))?;
    let path = format!("/nestrad.v1.SolveService/{method}");
    let path = PathAndQuery::try_from(path).unwrap();
    let request = Request::new(tokio_stream::iter(messages));
    let mut answers = grpc.streaming(request, path, Raw).await?.into_inner();
    while answers.message().await?.is_some() {}
    Ok(())
}

fn channel(master: &Master) -> Authorized {
    connect(&master.url(), &Credentials::default()).unwrap()
}

fn is_well(master: &Master) {
    let status = block_on(async { client(master).status(v1::StatusRequest {}).await });
    assert_eq!(status.unwrap().into_inner().scene_bytes, 0);
    let log = master.log();
    assert!(!log.contains("panicked"), "{log}");
}

#[test]
fn random_bytes_to_every_method_are_answered() {
    let master = Master::start(&[]);
    let mut runner = TestRunner::new(Config::with_cases(48));
    let bytes = || prop::collection::vec(any::<u8>(), 0..200).prop_map(Bytes::from);
    let messages = prop::collection::vec(bytes(), 1..4);
    runner
        .run(&messages, |messages| {
            block_on(async {
                let channel = channel(&master);
                for method in METHODS {
                    // only Status and ListSolves can make something of it
                    let _ = send(channel.clone(), method, messages.clone()).await;
                }
            });
            Ok(())
        })
        .unwrap();
    is_well(&master);
}

#[test]
fn messages_that_are_too_large_are_refused() {
    let master = Master::start(&[]);
    let large = Bytes::from(vec![0x0a; 9 << 20]);
    for method in METHODS {
        let sent = block_on(async { send(channel(&master), method, vec![large.clone()]).await });
        let status = sent.unwrap_err();
        assert!(status.message().contains("8388608"), "{method}: {status}");
    }
    is_well(&master);
}

#[test]
fn methods_that_do_not_exist_are_refused() {
    let master = Master::start(&[]);
    let sent = block_on(async { send(channel(&master), "Nothing", vec![Bytes::new()]).await });
    assert_eq!(sent.unwrap_err().code(), tonic::Code::Unimplemented);
    is_well(&master);
}
