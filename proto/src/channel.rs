//! The way to a master: its address, how it is known to be the right one, and who is asking.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use http::Uri;
use nestrad_common::bounded::with_line_feeds;
use thiserror::Error;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};
use tonic::{Request, Status};

use crate::token::{Token, TokenError, TokenFault, read_small};

/// A connection is given up when it is not there after this.
const CONNECT: Duration = Duration::from_secs(10);

/// A peer that is silent for so long is asked whether it is still there, and given up when it does not
/// answer within the same time.
pub(crate) const KEEP_ALIVE: Duration = Duration::from_secs(20);

/// Bytes that may be on the way in one stream, and in one connection.
pub const STREAM_WINDOW: u32 = 2 << 20;
pub(crate) const CONNECTION_WINDOW: u32 = 8 << 20;

/// Who the caller is, and how the master is recognised.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Credentials")]
pub struct Credentials {
    /// Certificate authority of the master, PEM [default: those that the system trusts]
    #[arg(long, value_name = "FILE")]
    pub ca: Option<PathBuf>,

    /// Certificate of this client or worker, PEM, for a master that asks for one
    #[arg(long, value_name = "FILE", requires = "key")]
    pub cert: Option<PathBuf>,

    /// Private key of --cert, PEM
    #[arg(long, value_name = "FILE", requires = "cert")]
    pub key: Option<PathBuf>,

    /// File with the token for the master [default: the variable NESTRAD_TOKEN]
    #[arg(long, value_name = "FILE")]
    pub token_file: Option<PathBuf>,
}

/// A channel whose calls carry the caller's token.
pub type Authorized = InterceptedService<Channel, Bearer>;

/// Puts the token into each call.
#[derive(Clone, Debug)]
pub struct Bearer(Option<MetadataValue<Ascii>>);

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(value) = &self.0 {
            let headers = request.metadata_mut();
            headers.insert("authorization", value.clone());
        }
        Ok(request)
    }
}

/// A channel to the master at `url`. It connects with the first call, and again whenever the
/// connection is lost. To be called within a tokio runtime.
pub fn connect(url: &str, credentials: &Credentials) -> Result<Authorized, ChannelError> {
    let token = match &credentials.token_file {
        Some(path) => Some(Token::read(path)?),
        None => Token::from_environment()?,
    };
    let header = token.as_ref().map(Token::header).transpose();
    let header = header.map_err(ChannelError::Token)?;
    let channel = endpoint(url, credentials)?.connect_lazy();
    Ok(InterceptedService::new(channel, Bearer(header)))
}

fn endpoint(url: &str, credentials: &Credentials) -> Result<Endpoint, ChannelError> {
    let wrong = || ChannelError::Url {
        found: url.to_owned(),
    };
    let uri: Uri = url.parse().map_err(|_| wrong())?;
    let secure = match uri.scheme_str() {
        Some("http") => false,
        Some("https") => true,
        _ => return Err(wrong()),
    };
    if uri.port_u16().is_none() || !matches!(uri.path(), "" | "/") || uri.query().is_some() {
        return Err(wrong());
    }
    let mut endpoint = Endpoint::from(uri)
        .connect_timeout(CONNECT)
        .tcp_nodelay(true)
        .http2_keep_alive_interval(KEEP_ALIVE)
        .keep_alive_timeout(KEEP_ALIVE)
        .keep_alive_while_idle(true)
        .initial_stream_window_size(STREAM_WINDOW)
        .initial_connection_window_size(CONNECTION_WINDOW);
    if secure {
        let setup = tls(credentials)?;
        endpoint = endpoint.tls_config(setup).map_err(ChannelError::Tls)?;
    } else if credentials.ca.is_some() || credentials.cert.is_some() {
        return Err(ChannelError::NotSecure {
            url: url.to_owned(),
        });
    }
    Ok(endpoint)
}

fn tls(credentials: &Credentials) -> Result<ClientTlsConfig, ChannelError> {
    let setup = ClientTlsConfig::new();
    let setup = match &credentials.ca {
        Some(path) => setup.ca_certificate(Certificate::from_pem(pem(path)?)),
        None => setup.with_native_roots(),
    };
    Ok(match (&credentials.cert, &credentials.key) {
        (Some(cert), Some(key)) => setup.identity(Identity::from_pem(pem(cert)?, pem(key)?)),
        _ => setup,
    })
}

/// The bytes of a PEM file.
pub(crate) fn pem(path: &Path) -> Result<Vec<u8>, PemError> {
    let fault = |message: String| PemError {
        path: path.to_owned(),
        message,
    };
    let bytes = read_small(path).map_err(|error| fault(format!("cannot be read: {error}")))?;
    let bytes = with_line_feeds(&bytes).into_owned();
    let begins = b"-----BEGIN ";
    if !bytes.windows(begins.len()).any(|window| window == begins) {
        return Err(fault("expected PEM, found no BEGIN line".to_owned()));
    }
    Ok(bytes)
}

/// A file that is no PEM.
#[derive(Debug, Error)]
#[error("{}: {message}", path.display())]
pub struct PemError {
    path: PathBuf,
    message: String,
}

/// Why there is no way to a master.
#[derive(Debug, Error)]
pub enum ChannelError {
    /// The address is none.
    #[error("master '{found}': expected http://HOST:PORT or https://HOST:PORT")]
    Url {
        /// As given.
        found: String,
    },
    /// Certificates without encryption.
    #[error("master '{url}': --ca and --cert need https")]
    NotSecure {
        /// As given.
        url: String,
    },
    /// A certificate or key cannot be used.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// Certificates and keys do not make a TLS set-up.
    #[error("certificates cannot be used")]
    Tls(#[source] tonic::transport::Error),
    /// There is no token where one was named.
    #[error(transparent)]
    TokenFile(#[from] TokenError),
    /// The token is none.
    #[error(transparent)]
    Token(TokenFault),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(url: &str, credentials: &Credentials) -> String {
        endpoint(url, credentials).unwrap_err().to_string()
    }

    #[test]
    fn addresses_are_checked() {
        let none = Credentials::default();
        for url in [
            "http://127.0.0.1:7410",
            "http://[::1]:7410/",
            "http://a.b:1",
        ] {
            assert!(endpoint(url, &none).is_ok(), "{url}");
        }
        for url in [
            "",
            "host:7410",
            "ftp://host:1",
            "http://host",
            "http://h:1/x",
            "http://h:1/?q",
        ] {
            assert!(refusal(url, &none).contains("http://HOST:PORT"), "{url}");
        }
    }

    #[test]
    fn certificates_need_https_and_must_be_there() {
        let credentials = Credentials {
            ca: Some("no such file".into()),
            ..Credentials::default()
        };
        assert!(refusal("http://h:1", &credentials).contains("need https"));
        assert!(refusal("https://h:1", &credentials).contains("no such file: cannot be read"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        std::fs::write(&path, "nothing").unwrap();
        let credentials = Credentials {
            ca: Some(path),
            ..Credentials::default()
        };
        assert!(refusal("https://h:1", &credentials).contains("ca.pem: expected PEM"));
    }
}
