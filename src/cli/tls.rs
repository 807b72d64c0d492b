use std::{path::Path, sync::Arc};

use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        self, RootCertStore, ServerConfig,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, pem, pem::PemObject},
        server::{VerifierBuilderError, WebPkiClientVerifier},
    },
};

use super::settings::Settings;
use crate::{http::Tls, service::Reread};

/// Why the service cannot speak TLS.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A setting stands without the others it needs.
    #[error("tls_cert and tls_key go together, and client_ca needs both")]
    Incomplete,
    /// A file cannot be read, or holds no PEM.
    #[error("cannot use {path} ({setting}): {error}")]
    File {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: String,
        /// Why.
        error: pem::Error,
    },
    /// Certificate and key, or their form, are not usable.
    #[error("cannot use the certificate (tls_cert, tls_key): {0}")]
    Certificate(#[from] rustls::Error),
    /// The authority for clients is not usable.
    #[error("cannot use the authority of client certificates (client_ca): {0}")]
    Authority(#[from] VerifierBuilderError),
}

/// The TLS of the two listeners, HTTP, then gRPC, read again when one of its files changes. `None` where
/// the settings name no certificate.
pub fn acceptors(settings: &Settings) -> Result<Option<(Tls, Tls)>, TlsError> {
    let (cert, key) = match (&settings.tls_cert, &settings.tls_key, &settings.client_ca) {
        (Some(cert), Some(key), _) => (cert.clone(), key.clone()),
        (None, None, None) => return Ok(None),
        _ => return Err(TlsError::Incomplete),
    };
    let authority = settings.client_ca.clone();
    let paths = [&cert, &key].into_iter().chain(&authority).cloned().collect();
    let read = move || read(&cert, &key, authority.as_deref());
    let files = Arc::new(Reread::open("a file of TLS", paths, read)?);
    let http = Arc::clone(&files);
    Ok(Some((Arc::new(move || http.latest().http), Arc::new(move || files.latest().grpc))))
}

/// What the files say, for each listener.
#[derive(Clone)]
struct Acceptors {
    http: TlsAcceptor,
    grpc: TlsAcceptor,
}

/// Reads all of them: a certificate and its key change together.
fn read(cert: &Path, key: &Path, authority: Option<&Path>) -> Result<Acceptors, TlsError> {
    let chain = certificates("tls_cert", cert)?;
    let key = PrivateKeyDer::from_pem_file(key).map_err(|error| file("tls_key", key, error))?;
    let provider = Arc::new(ring::default_provider());
    let builder = ServerConfig::builder_with_provider(Arc::clone(&provider))
        .with_safe_default_protocol_versions()?;
    let builder = match authority {
        None => builder.with_no_client_auth(),
        Some(path) => {
            let mut roots = RootCertStore::empty();
            for authority in certificates("client_ca", path)? {
                roots.add(authority)?;
            }
            let verifier = WebPkiClientVerifier::builder_with_provider(roots.into(), provider);
            builder.with_client_cert_verifier(verifier.build()?)
        }
    };
    // a key that is not the certificate's is refused here
    let config = builder.with_single_cert(chain, key)?;
    let speaking = |protocols: &[&[u8]]| {
        let mut config = config.clone();
        config.alpn_protocols = protocols.iter().map(|p| p.to_vec()).collect();
        TlsAcceptor::from(Arc::new(config))
    };
    Ok(Acceptors { http: speaking(&[b"h2", b"http/1.1"]), grpc: speaking(&[b"h2"]) })
}

fn certificates(
    setting: &'static str,
    path: &Path,
) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let read = CertificateDer::pem_file_iter(path).and_then(Iterator::collect);
    read.map_err(|error| file(setting, path, error))
}

fn file(setting: &'static str, path: &Path, error: pem::Error) -> TlsError {
    TlsError::File { setting, path: path.display().to_string(), error }
}
