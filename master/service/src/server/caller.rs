//! Who calls. Limits are shared out by it: what one client takes, others do not miss.

use std::net::IpAddr;

use tonic::Request;

/// A client: what it shows (token, certificate) and where it calls from. All that call from one machine with
/// the same token are one client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Caller([u8; 16]);

impl Caller {
    pub(super) fn of<T>(request: &Request<T>) -> Self {
        let certificates = request.peer_certs();
        let own = certificates.as_ref().and_then(|chain| chain.first());
        let token = request.metadata().get("authorization");
        Self::new(
            token.map_or(&[][..], |token| token.as_encoded_bytes()),
            own.map_or(&[][..], |certificate| certificate.as_ref()),
            request.remote_addr().map(|address| address.ip()),
        )
    }

    fn new(token: &[u8], certificate: &[u8], address: Option<IpAddr>) -> Self {
        // a hash, so that no token is kept or shown
        let mut hasher = blake3::Hasher::new_derive_key("nestrad caller 1");
        let place = address.map(network);
        for part in [token, certificate, place.as_ref().map_or(&[], |p| &p[..])] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        let mut caller = [0; 16];
        caller.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
        Self(caller)
    }

    #[cfg(test)]
    pub(super) fn number(number: u8) -> Self {
        Self([number; 16])
    }
}

/// What of an address tells machines apart: whoever has one address of IPv6 has all of its last 64 bits.
fn network(address: IpAddr) -> [u8; 16] {
    let mut bytes = match address.to_canonical() {
        IpAddr::V4(address) => return address.to_ipv6_mapped().octets(),
        IpAddr::V6(address) => address.octets(),
    };
    bytes[8..].fill(0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn callers_differ_by_token_certificate_and_machine() {
        let address = |text: &str| Some(text.parse().unwrap());
        let one = Caller::new(b"token", b"", address("10.0.0.1"));
        assert_eq!(one, Caller::new(b"token", b"", address("::ffff:10.0.0.1")));
        for other in [
            Caller::new(b"", b"token", address("10.0.0.1")),
            Caller::new(b"nekot", b"", address("10.0.0.1")),
            Caller::new(b"token", b"c", address("10.0.0.1")),
            Caller::new(b"token", b"", address("10.0.0.2")),
            Caller::new(b"token", b"", None),
        ] {
            assert_ne!(one, other);
        }
        let of = |text: &str| Caller::new(b"", b"", address(text));
        assert_eq!(of("2001:db8::1"), of("2001:db8::ffff:2"));
        assert_ne!(of("2001:db8::1"), of("2001:db8:0:1::1"));
    }
}
