//! How both ends of a connection between hosts authenticate each other: TLS 1.3, certificates of one
//! authority, and the list of revoked keys.

use std::sync::Arc;

use rustls::client::Resumption;
use rustls::client::danger::HandshakeSignatureValid;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::{CertificateDer, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::server::{NoServerSessionStorage, WebPkiClientVerifier};
use rustls::version::TLS13;
use rustls::{
    AlertDescription, CertificateError, ClientConfig, DigitallySignedStruct, DistinguishedName,
    Error, RootCertStore, ServerConfig, SignatureScheme,
};

use crate::certificate::CertificateFacts;
use crate::key_file::KeyFile;
use crate::revoked::RevokedKeys;

/// Accepts holders of keys: the certificate is valid, of the same authority, names a person or a host,
/// and is not revoked.
#[derive(Debug)]
pub struct KeyVerifier {
    chain: Arc<dyn ClientCertVerifier>,
    revoked: Arc<RevokedKeys>,
}

impl KeyVerifier {
    /// Accepts those whom the authority of `key` has certified.
    ///
    /// # Errors
    /// If that authority's certificate is not one.
    pub fn new(key: &KeyFile, revoked: Arc<RevokedKeys>) -> Result<Self, String> {
        let roots = Arc::new(trust_authority(key)?);
        let chain = WebPkiClientVerifier::builder_with_provider(roots, provider()).build();
        let chain = chain.map_err(|error| error.to_string())?;
        Ok(Self { chain, revoked })
    }
}

impl ClientCertVerifier for KeyVerifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.chain.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        let verified = self.chain.verify_client_cert(end_entity, intermediates, now)?;
        if self.revoked.contains_certificate(end_entity) {
            return Err(CertificateError::Revoked.into());
        }
        match CertificateFacts::read(end_entity) {
            Ok(_) => Ok(verified),
            Err(_) => Err(CertificateError::ApplicationVerificationFailure.into()),
        }
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.chain.verify_tls12_signature(message, certificate, signed)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.chain.verify_tls13_signature(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.chain.supported_verify_schemes()
    }
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

fn trust_authority(key: &KeyFile) -> Result<RootCertStore, String> {
    let mut roots = RootCertStore::empty();
    roots.add(key.authority.clone()).map_err(|error| error.to_string())?;
    Ok(roots)
}

/// How a gate with the key of a host accepts others.
///
/// # Errors
/// If the key does not fit its certificate.
pub fn gate_config(key: &KeyFile, revoked: Arc<RevokedKeys>) -> Result<ServerConfig, String> {
    let verifier = Arc::new(KeyVerifier::new(key, revoked)?);
    let builder = ServerConfig::builder_with_provider(provider());
    let builder = builder.with_protocol_versions(&[&TLS13]).map_err(|error| error.to_string())?;
    let mut config = builder
        .with_client_cert_verifier(verifier)
        .with_single_cert(vec![key.certificate.clone()], key.key.clone_key())
        .map_err(|error| error.to_string())?;
    // A resumed session is not verified again, so that a revoked key would be accepted.
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    Ok(config)
}

/// How a server of pages with the key of a host accepts browsers, which have no keys.
///
/// # Errors
/// If the key does not fit its certificate.
pub fn browser_config(key: &KeyFile) -> Result<ServerConfig, String> {
    let builder = ServerConfig::builder_with_provider(provider());
    let builder = builder.with_protocol_versions(&[&TLS13]).map_err(|error| error.to_string())?;
    let mut config = builder
        .with_no_client_auth()
        .with_single_cert(vec![key.certificate.clone()], key.key.clone_key())
        .map_err(|error| error.to_string())?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    // A resumed session would outlive the renewal of the key.
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    Ok(config)
}

/// How a person or a host with a key connects to gates: to those whom the same authority has certified
/// as hosts.
///
/// # Errors
/// If the key does not fit its certificate.
pub fn client_config(key: &KeyFile) -> Result<ClientConfig, String> {
    let builder = ClientConfig::builder_with_provider(provider());
    let builder = builder.with_protocol_versions(&[&TLS13]).map_err(|error| error.to_string())?;
    let mut config = builder
        .with_root_certificates(trust_authority(key)?)
        .with_client_auth_cert(vec![key.certificate.clone()], key.key.clone_key())
        .map_err(|error| error.to_string())?;
    config.resumption = Resumption::disabled();
    Ok(config)
}

/// Explains to a person why the gate has refused the key, or the person's computer the gate.
pub fn explain_tls_error(error: &Error) -> String {
    match error {
        Error::AlertReceived(AlertDescription::CertificateRevoked) => {
            "the gate refuses the key: it is revoked".into()
        }
        Error::AlertReceived(AlertDescription::CertificateExpired) => {
            "the gate refuses the key: it has expired, or is not valid yet by the robot's clock; \
             where the authority's key is: armor keys renew"
                .into()
        }
        Error::AlertReceived(
            AlertDescription::UnknownCA
            | AlertDescription::DecryptError
            | AlertDescription::BadCertificate,
        ) => "the gate refuses the key: another authority has made it".into(),
        Error::AlertReceived(
            AlertDescription::AccessDenied | AlertDescription::UnsupportedCertificate,
        ) => {
            "the gate refuses the key: it is of another kind; make it again with `armor keys renew`"
                .into()
        }
        Error::InvalidCertificate(
            CertificateError::Expired
            | CertificateError::ExpiredContext { .. }
            | CertificateError::NotValidYet
            | CertificateError::NotValidYetContext { .. },
        ) => "the gate's own key has expired, or is not valid yet by this computer's clock".into(),
        Error::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => "it is not a gate of the authority that has made the key".into(),
        Error::InvalidCertificate(_) => "its key is not that of a robot's host".into(),
        error => error.to_string(),
    }
}

/// Explains on the robot why a stranger is refused.
pub fn explain_refused_key(error: &Error) -> &'static str {
    match error {
        Error::InvalidCertificate(CertificateError::Revoked) => "its key is revoked",
        Error::InvalidCertificate(
            CertificateError::Expired | CertificateError::ExpiredContext { .. },
        ) => "its key has expired",
        Error::InvalidCertificate(
            CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. },
        ) => "its key is not valid yet by this host's clock",
        Error::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => "another authority has made its key",
        Error::InvalidCertificate(_) => {
            "its key is not for connecting; `armor keys renew` makes one"
        }
        Error::NoCertificatesPresented => "it has no key",
        Error::AlertReceived(_) => "it does not accept this host's key",
        _ => "it does not speak TLS 1.3",
    }
}
