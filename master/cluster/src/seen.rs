//! What a master sees of a worker by itself, and by what it knows it again.

use std::net::IpAddr;
use std::sync::Arc;

use tonic::Request;

use crate::scheduler::Identity;

/// What a master sees of a worker by itself.
pub(crate) struct Seen {
    address: Option<IpAddr>,
    certificate: Option<Vec<u8>>,
}

impl Seen {
    pub(crate) fn of<T>(request: &Request<T>) -> Self {
        let certificates = request.peer_certs();
        let own = certificates.as_deref().and_then(|chain| chain.first());
        Self {
            address: request.remote_addr().map(|address| address.ip()),
            certificate: own.map(|own| own.to_vec()),
        }
    }

    /// By what a worker is known when it comes again: its certificate where it has one, else its address; and its name.
    pub(crate) fn identity(&self, name: &str) -> Identity {
        let address = self.address.map(|address| address.to_string());
        let peer = match (&self.certificate, &address) {
            (Some(certificate), _) => &certificate[..],
            (None, Some(address)) => address.as_bytes(),
            (None, None) => &[],
        };
        let mut identity = blake3::Hasher::new();
        identity.update(&(peer.len() as u64).to_le_bytes());
        identity.update(peer).update(name.as_bytes());
        *identity.finalize().as_bytes()
    }

    /// Who that is, for people to read: nobody else has its certificate; without one, its address and its name have to
    /// do.
    pub(crate) fn who(&self, name: &str) -> Arc<str> {
        let address = self.address.map(|address| address.to_string());
        match &self.certificate {
            Some(own) => format!("with certificate {}", &blake3::hash(own).to_hex()[..16]),
            None => format!("{name} at {}", address.as_deref().unwrap_or("?")),
        }
        .into()
    }
}
