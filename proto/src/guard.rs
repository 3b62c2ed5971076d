//! Who may call what: a layer in front of all services of a master.
//!
//! Anybody may ask for the master's health. A client's token opens the client service, a worker's
//! token the worker service, either one the reflection service.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use http::header::AUTHORIZATION;
use http::{Request, Response};
use tonic::Status;
use tonic::transport::server::{TcpConnectInfo, TlsConnectInfo};
use tower::{Layer, Service};

use crate::token::Token;
use crate::v1::{solve_service_server, worker_service_server};

const HEALTH: &str = "grpc.health.v1.Health";

/// What a caller must show.
#[derive(Clone, Debug, Default)]
pub struct Guard {
    /// Opens the client service.
    pub client: Option<Token>,
    /// Opens the worker service. With neither token, both services are open.
    pub worker: Option<Token>,
    /// Whether the connection must have shown a certificate besides.
    pub certificate: bool,
}

impl Guard {
    /// Whether the caller of `path` with these credentials is let in.
    fn check(&self, path: &str, header: Option<&[u8]>, certificate: bool) -> Result<(), Status> {
        let service = path.split('/').nth(1).unwrap_or_default();
        if service == HEALTH {
            return Ok(());
        }
        if self.certificate && !certificate {
            return Err(Status::unauthenticated("expected a client certificate"));
        }
        if self.client.is_none() && self.worker.is_none() {
            return Ok(());
        }
        let shows = |token: &Option<Token>| {
            let both = token.as_ref().zip(header);
            both.is_some_and(|(token, header)| token.is_in(header))
        };
        let (client, worker) = (shows(&self.client), shows(&self.worker));
        match service {
            _ if !client && !worker => Err(Status::unauthenticated("expected a bearer token")),
            solve_service_server::SERVICE_NAME if !client => Err(Status::permission_denied(
                "expected a client's token, found a worker's",
            )),
            worker_service_server::SERVICE_NAME if !worker => Err(Status::permission_denied(
                "expected a worker's token, found a client's",
            )),
            _ => Ok(()),
        }
    }
}

impl<S> Layer<S> for Guard {
    type Service = Guarded<S>;

    fn layer(&self, inner: S) -> Guarded<S> {
        Guarded {
            guard: Arc::new(self.clone()),
            inner,
        }
    }
}

/// A service behind a [`Guard`].
#[derive(Clone, Debug)]
pub struct Guarded<S> {
    guard: Arc<Guard>,
    inner: S,
}

impl<S, Sent, Answer> Service<Request<Sent>> for Guarded<S>
where
    S: Service<Request<Sent>, Response = Response<Answer>>,
    S::Future: Send + 'static,
    S::Error: Send + 'static,
    Answer: Default + Send + 'static,
{
    type Response = Response<Answer>;
    type Error = S::Error;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, S::Error>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), S::Error>> {
        self.inner.poll_ready(context)
    }

    fn call(&mut self, request: Request<Sent>) -> Self::Future {
        let header = request.headers().get(AUTHORIZATION);
        let shown = request
            .extensions()
            .get::<TlsConnectInfo<TcpConnectInfo>>()
            .is_some_and(|info| info.peer_certs().is_some());
        let path = request.uri().path();
        match self.guard.check(path, header.map(|h| h.as_bytes()), shown) {
            Ok(()) => Box::pin(self.inner.call(request)),
            Err(status) => Box::pin(std::future::ready(Ok(status.into_http()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic::Code;

    const SOLVE: &str = "/nestrad.v1.SolveService/Status";
    const LEASE: &str = "/nestrad.v1.WorkerService/Lease";
    const REFLECTION: &str = "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo";

    fn guard() -> Guard {
        Guard {
            client: Some(Token::new("client-client-client").unwrap()),
            worker: Some(Token::new("worker-worker-worker").unwrap()),
            certificate: false,
        }
    }

    fn code(guard: &Guard, path: &str, header: &str) -> Option<Code> {
        let header = (!header.is_empty()).then_some(header.as_bytes());
        guard.check(path, header, false).err().map(|s| s.code())
    }

    #[test]
    fn each_token_opens_its_own_service() {
        let guard = guard();
        let (client, worker) = ("Bearer client-client-client", "Bearer worker-worker-worker");
        assert_eq!(code(&guard, SOLVE, client), None);
        assert_eq!(code(&guard, LEASE, worker), None);
        assert_eq!(code(&guard, SOLVE, worker), Some(Code::PermissionDenied));
        assert_eq!(code(&guard, LEASE, client), Some(Code::PermissionDenied));
        for token in [client, worker] {
            assert_eq!(code(&guard, REFLECTION, token), None);
        }
    }

    #[test]
    fn without_credentials_there_is_only_health() {
        let guard = guard();
        for header in [
            "",
            "Bearer client-client-clienT",
            "Basic client-client-client",
        ] {
            for path in [
                SOLVE,
                LEASE,
                REFLECTION,
                "/",
                "",
                "/x/y",
                "//grpc.health.v1.Health/",
            ] {
                assert_eq!(
                    code(&guard, path, header),
                    Some(Code::Unauthenticated),
                    "{path}"
                );
            }
            assert_eq!(code(&guard, "/grpc.health.v1.Health/Check", header), None);
        }
    }

    #[test]
    fn one_token_alone_keeps_the_other_service_closed() {
        let guard = Guard {
            worker: None,
            ..guard()
        };
        assert_eq!(code(&guard, LEASE, ""), Some(Code::Unauthenticated));
        let client = "Bearer client-client-client";
        assert_eq!(code(&guard, LEASE, client), Some(Code::PermissionDenied));
    }

    #[test]
    fn a_certificate_that_is_asked_for_must_be_shown() {
        let guard = Guard {
            certificate: true,
            ..Guard::default()
        };
        assert_eq!(code(&guard, SOLVE, ""), Some(Code::Unauthenticated));
        assert!(guard.check(SOLVE, None, true).is_ok());
        assert_eq!(code(&guard, "/grpc.health.v1.Health/Check", ""), None);
    }
}
