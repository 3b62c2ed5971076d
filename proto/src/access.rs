//! The door of a master: its certificate, who is let in, and where it may stand open.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use thiserror::Error;
use tonic::transport::server::Server;
use tonic::transport::{Certificate, Identity, ServerTlsConfig};
use tower::layer::util::{Identity as NoLayer, Stack};

use crate::authority::{Authority, AuthorityError};
use crate::channel::{CONNECTION_WINDOW, KEEP_ALIVE, PemError, STREAM_WINDOW, pem};
use crate::connections::Connections;
use crate::guard::{Credential, Guard};
use crate::token::{Token, TokenError};

/// A caller that has not agreed on keys after this is sent away.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// Streams of one connection at a time.
const MAX_STREAMS: u32 = 256;

/// Headers of a call, bytes.
const MAX_HEADERS: u32 = 16 << 10;

/// Who may call a master, and how it proves to be one.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Access")]
pub struct Access {
    /// Certificate of this master, PEM: clients and workers then use https
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,

    /// Private key of --tls-cert, PEM
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,

    /// Certificate authority of clients, PEM: a client with a certificate from it may solve
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub client_ca: Option<PathBuf>,

    /// Certificate authority of workers, PEM: a worker with a certificate from it may compute for this master,
    /// and nothing else
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub worker_ca: Option<PathBuf>,

    /// File with the token of clients: a client that sends it may solve
    #[arg(long, value_name = "FILE")]
    pub client_token: Option<PathBuf>,

    /// File with the token of workers: a worker that sends it may compute for this master, and nothing else
    #[arg(long, value_name = "FILE")]
    pub worker_token: Option<PathBuf>,

    /// Allow unencrypted connections at addresses that other machines can reach
    #[arg(long)]
    pub allow_plaintext: bool,
}

/// A server with a guard before its services.
pub type GuardedServer = Server<Stack<Guard, NoLayer>>;

impl Access {
    /// A server for `address` to which services can be added, and that serves these connections. Refused where other
    /// machines could read along or come in without credentials, and where clients cannot be told from workers.
    pub fn server(
        &self,
        address: SocketAddr,
        connections: &Connections,
    ) -> Result<GuardedServer, AccessError> {
        let credential = |token: &Option<PathBuf>, authority: &Option<PathBuf>| {
            Ok::<_, AccessError>(Credential {
                token: token.as_deref().map(Token::read).transpose()?,
                authority: authority.as_deref().map(Authority::read).transpose()?,
            })
        };
        let guard = Guard {
            client: credential(&self.client_token, &self.client_ca)?,
            worker: credential(&self.worker_token, &self.worker_ca)?,
            connections: connections.clone(),
        };
        self.check_apart(&guard.client, &guard.worker)?;
        if !address.ip().is_loopback() {
            if self.tls_cert.is_none() && !self.allow_plaintext {
                return Err(AccessError::Plaintext { address });
            }
            if guard.client.is_empty() && guard.worker.is_empty() {
                return Err(AccessError::Open { address });
            }
        }
        let mut server = Server::builder()
            .tcp_nodelay(true)
            .http2_keepalive_interval(Some(KEEP_ALIVE))
            .http2_keepalive_timeout(Some(KEEP_ALIVE))
            .initial_stream_window_size(STREAM_WINDOW)
            .initial_connection_window_size(CONNECTION_WINDOW)
            .max_concurrent_streams(MAX_STREAMS)
            .http2_max_header_list_size(MAX_HEADERS);
        if let (Some(cert), Some(key)) = (&self.tls_cert, &self.tls_key) {
            let mut setup = ServerTlsConfig::new()
                .identity(Identity::from_pem(pem(cert)?, pem(key)?))
                .timeout(HANDSHAKE);
            let mut authorities = Vec::new();
            for path in [&self.client_ca, &self.worker_ca].into_iter().flatten() {
                authorities.extend(pem(path)?);
                authorities.push(b'\n');
            }
            if !authorities.is_empty() {
                // health is answered without a certificate; the guard sees to the rest
                setup = setup
                    .client_ca_root(Certificate::from_pem(authorities))
                    .client_auth_optional(true);
            }
            server = server.tls_config(setup).map_err(AccessError::Tls)?;
        }
        Ok(server.layer(guard))
    }

    /// What clients show is not what workers show.
    fn check_apart(&self, client: &Credential, worker: &Credential) -> Result<(), AccessError> {
        let name = |path: &Option<PathBuf>| path.clone().unwrap_or_default();
        let tokens = (&client.token, &worker.token);
        let by_token = matches!(tokens, (Some(_), Some(_)));
        if let (Some(client), Some(worker)) = tokens
            && client.is_same_as(worker)
        {
            return Err(AccessError::OneToken {
                client: name(&self.client_token),
                worker: name(&self.worker_token),
            });
        }
        if let (Some(client), Some(worker)) = (&client.authority, &worker.authority)
            && !by_token
            && client.shares_with(worker)
        {
            return Err(AccessError::OneAuthority {
                client: name(&self.client_ca),
                worker: name(&self.worker_ca),
            });
        }
        Ok(())
    }
}

/// Why a master does not open its door.
#[derive(Debug, Error)]
pub enum AccessError {
    /// Others could read along.
    #[error(
        "other machines can reach {address}: expected --tls-cert and --tls-key, or --allow-plaintext"
    )]
    Plaintext {
        /// Where it was to listen.
        address: SocketAddr,
    },
    /// Anybody could come in.
    #[error(
        "other machines can reach {address}: expected --client-token and --worker-token, or --client-ca and --worker-ca"
    )]
    Open {
        /// Where it was to listen.
        address: SocketAddr,
    },
    /// A client would be a worker, and a worker a client.
    #[error(
        "{} and {}: expected two tokens, found the same one: with it, workers could solve and clients could compute",
        client.display(), worker.display()
    )]
    OneToken {
        /// File with the token of clients.
        client: PathBuf,
        /// File with the token of workers.
        worker: PathBuf,
    },
    /// A client would be a worker, and a worker a client.
    #[error(
        "{} and {}: expected two authorities, found a certificate that is in both: with it, workers could solve and \
         clients could compute",
        client.display(), worker.display()
    )]
    OneAuthority {
        /// The authority of clients.
        client: PathBuf,
        /// The authority of workers.
        worker: PathBuf,
    },
    /// A certificate or key cannot be used.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// An authority cannot be used.
    #[error(transparent)]
    Authority(#[from] AuthorityError),
    /// A token cannot be used.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// Certificate and key do not make a TLS set-up.
    #[error("certificates cannot be used")]
    Tls(#[source] tonic::transport::Error),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_machines_need_encryption_and_credentials() {
        let folder = tempfile::tempdir().unwrap();
        let token = folder.path().join("token");
        std::fs::write(&token, "0123456789abcdef").unwrap();
        let loopback: SocketAddr = "127.0.0.1:0".parse().unwrap();
        let any: SocketAddr = "0.0.0.0:7410".parse().unwrap();
        let closed = Access::default();
        let server = |access: &Access, at| access.server(at, &Connections::default());
        assert!(server(&closed, loopback).is_ok());
        let refusal = |access: &Access| server(access, any).err().unwrap().to_string();
        assert!(refusal(&closed).contains("--allow-plaintext"));
        let plain = Access {
            allow_plaintext: true,
            ..Access::default()
        };
        assert!(refusal(&plain).contains("--client-token"));
        let known = Access {
            client_token: Some(token),
            ..plain
        };
        assert!(server(&known, any).is_ok());
        let hidden = Access {
            allow_plaintext: false,
            ..known
        };
        assert!(refusal(&hidden).contains("0.0.0.0:7410"));
    }

    #[test]
    fn clients_and_workers_do_not_show_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            Some(path)
        };
        let authority = || {
            let mut params = rcgen::CertificateParams::default();
            params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
            let key = rcgen::KeyPair::generate().unwrap();
            params.self_signed(&key).unwrap().pem()
        };
        let (one, other) = (authority(), authority());
        let two = format!("{other}{one}");
        let here: SocketAddr = "127.0.0.1:0".parse().unwrap();
        let refusal = |access: Access| {
            let server = access.server(here, &Connections::default());
            server
                .err()
                .map(|error| error.to_string())
                .unwrap_or_default()
        };
        let tokens = |worker: &str| Access {
            client_token: file("client", "0123456789abcdef"),
            worker_token: file("worker", worker),
            ..Access::default()
        };
        assert!(refusal(tokens(" 0123456789abcdef\n")).contains("worker: expected two tokens"));
        assert_eq!(refusal(tokens("0123456789abcdeg")), "");
        let authorities = |worker: &str| Access {
            client_ca: file("client.pem", &one),
            worker_ca: file("worker.pem", worker),
            ..Access::default()
        };
        assert!(refusal(authorities(&two)).contains("expected two authorities"));
        assert_eq!(refusal(authorities(&other)), "");
        // a token for each tells them apart, one for clients alone does not
        let mut both = Access {
            worker_token: None,
            ..tokens("")
        };
        both.client_ca = authorities(&one).client_ca;
        both.worker_ca = authorities(&one).worker_ca;
        assert!(refusal(both.clone()).contains("expected two authorities"));
        both.worker_token = tokens("0123456789abcdeg").worker_token;
        assert_eq!(refusal(both), "");
    }
}
