//! TLS to those we connect to: who is trusted, and the handshake.

use std::path::Path;
use std::sync::Arc;
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

/// Makes TLS of a connection to `host`. Trusted are the authorities in `ca_file`, and no others, or without one those of the
/// machine. They are read each time, so that others hold from the next connection on.
pub(super) async fn secured(
    stream: TcpStream,
    host: &str,
    ca_file: Option<&Path>,
) -> Result<TlsStream<TcpStream>, String> {
    let name = ServerName::try_from(host.to_owned())
        .map_err(|error| format!("{host:?} can have no certificate: {error}"))?;
    let connected = TlsConnector::from(config(ca_file)?)
        .connect(name, stream)
        .await;
    connected.map_err(|error| format!("no TLS: {error}"))
}

/// What a handshake goes by: TLS 1.2 or 1.3, and the authorities that are trusted.
pub(super) fn config(ca_file: Option<&Path>) -> Result<Arc<ClientConfig>, String> {
    let roots = match ca_file {
        Some(file) => own(file)?,
        None => of_the_machine()?,
    };
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error| error.to_string())?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(Arc::new(config))
}

/// The authorities in a PEM file.
pub(super) fn own(file: &Path) -> Result<RootCertStore, String> {
    let fail = |why: &dyn std::fmt::Display| format!("ca_file {}: {why}", file.display());
    let mut roots = RootCertStore::empty();
    let certificates = CertificateDer::pem_file_iter(file).map_err(|error| fail(&error))?;
    for certificate in certificates {
        let certificate = certificate.map_err(|error| fail(&error))?;
        roots.add(certificate).map_err(|error| fail(&error))?;
    }
    if roots.is_empty() {
        return Err(fail(&"it holds no certificate"));
    }
    Ok(roots)
}

fn of_the_machine() -> Result<RootCertStore, String> {
    let found = rustls_native_certs::load_native_certs();
    let mut roots = RootCertStore::empty();
    // One that cannot be read is no reason to trust none.
    roots.add_parsable_certificates(found.certs);
    if roots.is_empty() {
        let why = found
            .errors
            .first()
            .map_or_else(String::new, |error| format!(": {error}"));
        return Err(format!(
            "this machine knows no certificate authority{why}; install ca-certificates, or set ca_file"
        ));
    }
    Ok(roots)
}
