//! Why a call failed, in words for people. The transport says "transport error" and keeps the cause to itself.

use std::error::Error;
use std::io;

use rustls::AlertDescription as Alert;
use tonic::Status;

/// Why a call failed, in one line.
pub fn of(status: &Status) -> String {
    if let Some(reason) = of_credentials(status) {
        return reason;
    }
    let mut causes = sources(status).map(ToString::to_string);
    let message = status.message().to_owned();
    match causes.by_ref().last() {
        Some(last) if !message.contains(&last) => format!("{message}: {last}"),
        _ => message,
    }
}

/// What is wrong with certificates, if that is why the call failed: then trying again is of no use.
pub fn of_credentials(status: &Status) -> Option<String> {
    sources(status).find_map(of_tls)
}

fn sources(status: &Status) -> impl Iterator<Item = &(dyn Error + 'static)> {
    std::iter::successors(status.source(), |error| source(*error))
}

fn source<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a (dyn Error + 'static)> {
    match error.downcast_ref::<io::Error>() {
        // its own source is that of what it holds
        Some(held) => held.get_ref().map(|held| held as &(dyn Error + 'static)),
        None => error.source(),
    }
}

/// What a master says of a certificate that it does not take.
const REFUSALS: [Alert; 9] = [
    Alert::BadCertificate,
    Alert::UnsupportedCertificate,
    Alert::CertificateRevoked,
    Alert::CertificateExpired,
    Alert::CertificateUnknown,
    Alert::UnknownCA,
    Alert::AccessDenied,
    Alert::DecryptError,
    Alert::CertificateRequired,
];

fn of_tls(error: &(dyn Error + 'static)) -> Option<String> {
    // HTTP/2 keeps of an alert that comes after the handshake only what it says
    let text = error.to_string();
    let is_said = |alert: &Alert| text.ends_with(&rustls::Error::AlertReceived(*alert).to_string());
    if REFUSALS.iter().any(is_said) {
        return Some(format!(
            "the master refuses the certificate of this caller (--cert): {text}"
        ));
    }
    match error.downcast_ref::<rustls::Error>()? {
        rustls::Error::InvalidCertificate(_) => Some(format!(
            "the certificate of the master is not trusted (--ca): {text}"
        )),
        rustls::Error::InvalidMessage(_) => Some(format!(
            "the master does not speak TLS, or another port was meant: {text}"
        )),
        _ => None,
    }
}
