//! Calls of a master that may not be there.

use std::future::Future;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use nestrad_proto::v1;
use nestrad_proto::v1::solve_service_client::SolveServiceClient;
use tonic::Status;
use tonic::transport::{Channel, Endpoint};

/// The client service of a master.
pub(crate) type Client = SolveServiceClient<Channel>;

/// Runs a future for so long at most.
pub(crate) fn within<T>(
    time: Duration,
    future: impl Future<Output = Result<T, Status>>,
) -> Result<T, Status> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let runtime = runtime.map_err(|error| Status::internal(error.to_string()))?;
    let bounded = runtime.block_on(async { tokio::time::timeout(time, future).await });
    // calls that are not over are not waited for
    runtime.shutdown_background();
    bounded.map_err(|_| Status::deadline_exceeded(format!("no answer within {time:?}")))?
}

/// Connects to a master, from an address of this machine.
pub(crate) async fn connect(master: SocketAddr, from: Option<IpAddr>) -> Result<Client, Status> {
    let endpoint = Endpoint::try_from(format!("http://{master}"))
        .map_err(|error| Status::internal(error.to_string()))?
        .local_address(from)
        .connect_timeout(Duration::from_secs(5));
    let channel = endpoint.connect().await;
    channel
        .map(SolveServiceClient::new)
        .map_err(|error| Status::unavailable(error.to_string()))
}

/// How a master is.
pub(crate) fn status(master: SocketAddr, time: Duration) -> Result<v1::StatusResponse, Status> {
    within(time, async {
        let mut client = connect(master, None).await?;
        Ok(client.status(v1::StatusRequest {}).await?.into_inner())
    })
}
