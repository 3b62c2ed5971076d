//! Who may call what: a layer in front of all services of a master.
//!
//! Anybody may ask for the master's health. What a client shows opens the client service, what a worker
//! shows the worker service, either one the reflection service.

use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use http::header::AUTHORIZATION;
use http::{Request, Response};
use rustls::pki_types::CertificateDer;
use tonic::Status;
use tonic::transport::server::{TcpConnectInfo, TlsConnectInfo};
use tower::{Layer, Service};

use crate::authority::Authority;
use crate::connections::Connections;
use crate::token::Token;
use crate::v1::{solve_service_server, worker_service_server};

const HEALTH: &str = "grpc.health.v1.Health";

/// What callers must show. With nothing to show for either service, both are open.
#[derive(Clone, Debug, Default)]
pub struct Guard {
    /// Opens the client service.
    pub client: Credential,
    /// Opens the worker service.
    pub worker: Credential,
    /// Where it is known who has been let in.
    pub connections: Connections,
}

/// What opens a service: all of it must be shown. Without anything, nobody is let in.
#[derive(Clone, Debug, Default)]
pub struct Credential {
    /// A token.
    pub token: Option<Token>,
    /// A certificate of this authority.
    pub authority: Option<Authority>,
}

/// What a caller shows.
#[derive(Clone, Copy, Debug, Default)]
struct Shown<'a> {
    header: Option<&'a [u8]>,
    chain: &'a [CertificateDer<'static>],
}

impl Credential {
    /// Whether there is nothing to show.
    pub fn is_empty(&self) -> bool {
        self.token.is_none() && self.authority.is_none()
    }

    fn is_in(&self, shown: Shown) -> bool {
        let token = |token: &Token| shown.header.is_some_and(|header| token.is_in(header));
        let authority = |authority: &Authority| authority.stands_behind(shown.chain);
        !self.is_empty()
            && self.token.as_ref().is_none_or(token)
            && self.authority.as_ref().is_none_or(authority)
    }

    /// What to show.
    fn wanted(&self) -> &'static str {
        match (&self.token, &self.authority) {
            (Some(_), None) => "a bearer token",
            (None, Some(_)) => "a certificate",
            (Some(_), Some(_)) => "a bearer token and a certificate",
            (None, None) => "credentials that nobody has",
        }
    }
}

impl Guard {
    /// Whether the caller of `path` is let in.
    fn check(&self, path: &str, shown: Shown) -> Result<(), Status> {
        let service = service(path);
        if service == HEALTH || (self.client.is_empty() && self.worker.is_empty()) {
            return Ok(());
        }
        let (wanted, other) = match service {
            solve_service_server::SERVICE_NAME => (&self.client, &self.worker),
            worker_service_server::SERVICE_NAME => (&self.worker, &self.client),
            // reflection is open to both
            _ if self.worker.is_in(shown) => return Ok(()),
            _ => (&self.client, &self.client),
        };
        if wanted.is_in(shown) {
            Ok(())
        } else if other.is_in(shown) {
            let text = "these credentials are for another service";
            Err(Status::permission_denied(text))
        } else {
            let text = format!("expected {}", wanted.wanted());
            Err(Status::unauthenticated(text))
        }
    }
}

impl Guard {
    /// The caller at an address keeps its connection; who only asks for health gives way where there is no room.
    fn let_in(&self, path: &str, from: Option<SocketAddr>) {
        match from {
            Some(address) if service(path) == HEALTH => self.connections.has_asked(address),
            Some(address) => self.connections.is_let_in(address),
            None => {}
        }
    }
}

/// The service that a path is of.
fn service(path: &str) -> &str {
    path.split('/').nth(1).unwrap_or_default()
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
        let secure = request.extensions().get::<TlsConnectInfo<TcpConnectInfo>>();
        let chain = secure.and_then(|info| info.peer_certs());
        let plain = request.extensions().get::<TcpConnectInfo>();
        let from = secure.map(|info| info.get_ref()).or(plain);
        let from = from.and_then(|info| info.remote_addr());
        let shown = Shown {
            header: header.map(|h| h.as_bytes()),
            chain: chain.as_ref().map_or(&[], |chain| &chain[..]),
        };
        let path = request.uri().path();
        match self.guard.check(path, shown) {
            Ok(()) => {
                self.guard.let_in(path, from);
                Box::pin(self.inner.call(request))
            }
            Err(status) => Box::pin(std::future::ready(Ok(status.into_http()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};
    use tonic::Code;

    use super::*;

    const SOLVE: &str = "/nestrad.v1.SolveService/Status";
    const LEASE: &str = "/nestrad.v1.WorkerService/Lease";
    const REFLECTION: &str = "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo";

    fn guard() -> Guard {
        let credential = |token| Credential {
            token: Some(Token::new(token).unwrap()),
            authority: None,
        };
        Guard {
            client: credential("client-client-client"),
            worker: credential("worker-worker-worker"),
            connections: Connections::default(),
        }
    }

    fn code(guard: &Guard, path: &str, header: &str) -> Option<Code> {
        let shown = Shown {
            header: (!header.is_empty()).then_some(header.as_bytes()),
            chain: &[],
        };
        guard.check(path, shown).err().map(|s| s.code())
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
            worker: Credential::default(),
            ..guard()
        };
        assert_eq!(code(&guard, LEASE, ""), Some(Code::Unauthenticated));
        let client = "Bearer client-client-client";
        assert_eq!(code(&guard, LEASE, client), Some(Code::PermissionDenied));
    }

    #[test]
    fn each_authority_opens_its_own_service() {
        let folder = tempfile::tempdir().unwrap();
        let authority = |name: &str| {
            let mut params = CertificateParams::new(Vec::new()).unwrap();
            params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
            params.distinguished_name.push(DnType::CommonName, name);
            let key = KeyPair::generate().unwrap();
            let path = folder.path().join(name);
            std::fs::write(&path, params.self_signed(&key).unwrap().pem()).unwrap();
            let issuer = Issuer::new(params, key);
            let own = CertificateParams::new(vec!["caller".to_owned()]).unwrap();
            let signed = own.signed_by(&KeyPair::generate().unwrap(), &issuer);
            let chain = [signed.unwrap().der().clone()];
            (Authority::read(&path).unwrap(), chain)
        };
        let [(clients, client), (workers, worker), (_, stranger)] =
            ["clients", "workers", "strangers"].map(authority);
        let by = |authority| Credential {
            token: None,
            authority: Some(authority),
        };
        let guard = Guard {
            client: by(clients),
            worker: by(workers),
            connections: Connections::default(),
        };
        let code = |path, chain: &[CertificateDer<'static>]| {
            let shown = Shown {
                header: None,
                chain,
            };
            guard.check(path, shown).err().map(|s| s.code())
        };
        assert_eq!(code(SOLVE, &client), None);
        assert_eq!(code(LEASE, &worker), None);
        assert_eq!(code(SOLVE, &worker), Some(Code::PermissionDenied));
        assert_eq!(code(LEASE, &client), Some(Code::PermissionDenied));
        for path in [SOLVE, LEASE, REFLECTION] {
            assert_eq!(code(path, &stranger), Some(Code::Unauthenticated));
            assert_eq!(code(path, &[]), Some(Code::Unauthenticated));
        }
        for chain in [&client, &worker] {
            assert_eq!(code(REFLECTION, chain), None);
        }
        assert_eq!(code("/grpc.health.v1.Health/Check", &[]), None);
    }

    #[test]
    fn a_token_and_a_certificate_must_both_be_shown() {
        let mut guard = guard();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca");
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        std::fs::write(&path, params.self_signed(&key).unwrap().pem()).unwrap();
        guard.client.authority = Some(Authority::read(&path).unwrap());
        let header = "Bearer client-client-client";
        assert_eq!(code(&guard, SOLVE, header), Some(Code::Unauthenticated));
        assert_eq!(code(&guard, LEASE, "Bearer worker-worker-worker"), None);
    }
}
