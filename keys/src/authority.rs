//! The certificate authority: the one key that makes all others. A gate and a person need only its
//! certificate, which is part of their own key files.

use std::time::Duration;

use armor_wire::name::is_name;
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose, SanType, SerialNumber, date_time_ymd,
};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::GATE_NAME;
use crate::certificate::{CertificateFacts, Serial};
use crate::expiry::{DAY_S, format_date};
use crate::identity::{KeyHolder, KeyPurpose};
use crate::site_name::{MAX_SITES, SiteName};

/// How long an authority is valid, in days.
const AUTHORITY_DAYS: i64 = 20 * 365;
/// A key is valid from this long before it is made, so that clocks may differ.
const MARGIN_S: i64 = DAY_S;

/// The time in which a key is valid, in seconds since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    /// The first second.
    pub not_before_s: i64,
    /// The last second.
    pub not_after_s: i64,
}

impl Validity {
    /// From `now_s` on for a number of days.
    pub fn days_from(now_s: i64, days: i64) -> Self {
        let not_after_s = now_s.saturating_add(days.saturating_mul(DAY_S));
        Self { not_before_s: now_s.saturating_sub(MARGIN_S), not_after_s }
    }
}

/// What a key is made for.
#[derive(Clone, Debug)]
pub struct NewKey {
    /// Who holds it.
    pub holder: KeyHolder,
    /// The names and addresses under which browsers open the page of a host.
    pub sites: Vec<SiteName>,
}

impl From<KeyHolder> for NewKey {
    fn from(holder: KeyHolder) -> Self {
        Self { holder, sites: Vec::new() }
    }
}

/// The key of an authority.
pub struct Authority {
    issuer: Issuer<'static, KeyPair>,
    certificate: String,
    not_after_s: i64,
}

/// A key that an authority has made.
pub struct IssuedKey {
    /// What its certificate contains.
    pub facts: CertificateFacts,
    /// The text of its file, which contains the secret key.
    pub text: String,
}

impl Authority {
    /// A new authority with a random key.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn create(now_s: i64) -> Result<Self, String> {
        let validity = Validity::days_from(now_s, AUTHORITY_DAYS);
        let key = KeyPair::generate().map_err(|error| error.to_string())?;
        let serial = Serial::random();
        let mut parameters = parameters_for(&serial, validity);
        // Two authorities never have the same name.
        let name = format!("Armor authority {serial}");
        parameters.distinguished_name.push(DnType::CommonName, name);
        parameters.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        parameters.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let certificate = parameters.self_signed(&key).map_err(|error| error.to_string())?.pem();
        let not_after_s = validity.not_after_s;
        Ok(Self { issuer: Issuer::new(parameters, key), certificate, not_after_s })
    }

    /// The text of the authority's file, which contains its secret key.
    pub fn to_text(&self) -> String {
        format!(
            "The key of an Armor authority, valid until {}. It makes keys for robots and people: \
             keep it secret, off the robot, and in a backup.\n{}{}",
            format_date(self.not_after_s),
            self.issuer.key().serialize_pem(),
            self.certificate
        )
    }

    /// Reads the authority's file.
    ///
    /// # Errors
    /// If it is not one.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let wrong = "it is not the key of an authority, which `armor keys init` makes";
        let der = CertificateDer::from_pem_slice(text.as_bytes()).map_err(|_| wrong)?;
        let (_, certificate) = X509Certificate::from_der(&der).map_err(|_| wrong)?;
        if !certificate.is_ca() {
            return Err(wrong.into());
        }
        let not_after_s = certificate.validity().not_after.timestamp();
        let at = text.find("-----BEGIN PRIVATE KEY-----").ok_or(wrong)?;
        let key = KeyPair::from_pem(&text[at..]).map_err(|_| wrong)?;
        let at = text.find("-----BEGIN CERTIFICATE-----").ok_or(wrong)?;
        let certificate = text[at..].to_owned();
        let issuer = Issuer::from_ca_cert_der(&der, key).map_err(|error| error.to_string())?;
        Ok(Self { issuer, certificate, not_after_s })
    }

    /// Its certificate, in DER.
    ///
    /// # Errors
    /// If its file was changed.
    pub(crate) fn certificate_der(&self) -> Result<Vec<u8>, String> {
        let der = CertificateDer::from_pem_slice(self.certificate.as_bytes());
        der.map(|der| der.to_vec()).map_err(|error| error.to_string())
    }

    /// Until when the authority is valid, in seconds since 1970.
    pub fn not_after_s(&self) -> i64 {
        self.not_after_s
    }

    /// Makes a key.
    ///
    /// # Errors
    /// If the name is not one, a person is to have names of sites, the time is empty or ends after
    /// the authority's, or the system has no random numbers.
    pub fn issue_key(
        &self,
        key: impl Into<NewKey>,
        validity: Validity,
    ) -> Result<IssuedKey, String> {
        let NewKey { holder, sites } = key.into();
        if !is_name(&holder.name) {
            return Err(format!(
                "{:?} is not a name: letters, digits, _ and -, a letter first, at most 64",
                holder.name
            ));
        }
        if holder.purpose != KeyPurpose::Host && !sites.is_empty() {
            return Err("only the key of a host names what browsers open: leave out --at".into());
        }
        if sites.len() > MAX_SITES {
            return Err(format!("a key names at most {MAX_SITES} names and addresses"));
        }
        if validity.not_after_s > self.not_after_s {
            return Err(format!(
                "the authority itself is valid until {} only: choose fewer days",
                format_date(self.not_after_s)
            ));
        }
        let serial = Serial::random();
        let mut parameters = parameters_for(&serial, validity);
        parameters.distinguished_name.push(DnType::CommonName, holder.to_string());
        let text_of =
            |text: String| text.try_into().map_err(|_| "the name is not ASCII".to_owned());
        parameters.subject_alt_names = vec![SanType::URI(text_of(holder.to_uri())?)];
        parameters.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        // A host connects to the other hosts of its system, too.
        parameters.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        if holder.purpose == KeyPurpose::Host {
            parameters.subject_alt_names.push(SanType::DnsName(text_of(GATE_NAME.into())?));
            parameters.extended_key_usages.push(ExtendedKeyUsagePurpose::ServerAuth);
            for site in sites {
                parameters.subject_alt_names.push(match site {
                    SiteName::Name(name) => SanType::DnsName(text_of(name)?),
                    SiteName::Address(address) => SanType::IpAddress(address),
                });
            }
        }
        let key = KeyPair::generate().map_err(|error| error.to_string())?;
        let certificate =
            parameters.signed_by(&key, &self.issuer).map_err(|error| error.to_string())?;
        let text = format!(
            "The Armor key of {holder}, valid until {}. Keep it secret.\n{}{}{}",
            format_date(validity.not_after_s),
            key.serialize_pem(),
            certificate.pem(),
            self.certificate
        );
        Ok(IssuedKey { facts: CertificateFacts::read(certificate.der())?, text })
    }
}

fn parameters_for(serial: &Serial, validity: Validity) -> CertificateParams {
    let epoch = date_time_ymd(1970, 1, 1);
    let seconds = |s: i64| Duration::from_secs(s.max(0).unsigned_abs());
    let mut parameters = CertificateParams::default();
    parameters.distinguished_name = DistinguishedName::new();
    parameters.serial_number = Some(SerialNumber::from_slice(serial.bytes()));
    parameters.not_before = epoch + seconds(validity.not_before_s);
    parameters.not_after = epoch + seconds(validity.not_after_s);
    parameters.use_authority_key_identifier_extension = true;
    parameters
}
