//! Authorities, whose certificates say what a caller may do.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::RootCertStore;
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
use thiserror::Error;

use crate::channel::{PemError, pem};

/// One or more certificates that others are signed with.
#[derive(Clone)]
pub struct Authority {
    verifier: Arc<dyn ClientCertVerifier>,
    certificates: Vec<CertificateDer<'static>>,
}

impl Authority {
    /// Reads the certificates of an authority, PEM.
    pub fn read(path: &Path) -> Result<Self, AuthorityError> {
        let fault = |message: String| AuthorityError::Content {
            path: path.to_owned(),
            message,
        };
        let bytes = pem(path)?;
        let mut roots = RootCertStore::empty();
        let mut certificates = Vec::new();
        for certificate in CertificateDer::pem_slice_iter(&bytes) {
            let certificate = certificate.map_err(|e| fault(e.to_string()))?;
            certificates.push(certificate.clone());
            roots.add(certificate).map_err(|e| fault(e.to_string()))?;
        }
        let provider = Arc::new(ring::default_provider());
        WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider)
            .build()
            .map(|verifier| Self {
                verifier,
                certificates,
            })
            .map_err(|e| fault(e.to_string()))
    }

    /// Whether it stands behind a caller's chain of certificates, own certificate first. That the caller
    /// has the key to it was shown when the connection was made.
    pub fn stands_behind(&self, chain: &[CertificateDer<'_>]) -> bool {
        let Some((own, between)) = chain.split_first() else {
            return false;
        };
        let verified = self
            .verifier
            .verify_client_cert(own, between, UnixTime::now());
        verified.is_ok()
    }

    /// Whether a certificate is of both authorities.
    pub(crate) fn shares_with(&self, other: &Self) -> bool {
        let mut own = self.certificates.iter();
        own.any(|certificate| other.certificates.contains(certificate))
    }
}

impl fmt::Debug for Authority {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Authority(..)")
    }
}

/// Why there is no authority.
#[derive(Debug, Error)]
pub enum AuthorityError {
    /// The file is no PEM.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// What is there is no certificate of an authority.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
}
