use x509_cert::{Certificate, der::Decode};

use super::sha256;

/// Who is at the other end of a connection: the client certificate that its TLS handshake accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer(String);

impl Peer {
    /// The peer that shows the certificate `der`, which the handshake has checked.
    ///
    /// Its name is the certificate's subject as RFC 4514 writes it, such as `CN=press 4,O=Example`, so
    /// that a renewed certificate is the same peer. One without a subject is known by its digest.
    pub fn of(der: &[u8]) -> Self {
        let subject = Certificate::from_der(der).map(|read| read.tbs_certificate.subject);
        match subject {
            Ok(subject) if !subject.is_empty() => Self(subject.to_string()),
            _ => Self(format!("sha256={}", sha256(der))),
        }
    }

    /// Its name.
    pub fn subject(&self) -> &str {
        &self.0
    }

    /// A peer of that name.
    #[cfg(test)]
    pub fn named(subject: &str) -> Self {
        Self(subject.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use rcgen::{CertificateParams, DnType, KeyPair};

    use super::*;

    fn certificate(names: &[(DnType, &str)]) -> Vec<u8> {
        let mut params = CertificateParams::new(vec!["localhost".to_owned()]).unwrap();
        params.distinguished_name = rcgen::DistinguishedName::new();
        for (kind, name) in names {
            params.distinguished_name.push(kind.clone(), *name);
        }
        params.self_signed(&KeyPair::generate().unwrap()).unwrap().der().to_vec()
    }

    fn peer(names: &[(DnType, &str)]) -> String {
        Peer::of(&certificate(names)).subject().to_owned()
    }

    #[test]
    fn a_peer_has_its_certificates_subject_for_a_name() {
        use DnType::{CommonName, OrganizationName};
        let name = peer(&[(OrganizationName, "Example"), (CommonName, "press 4")]);
        assert_eq!(name, "CN=press 4,O=Example");
        // names that look alike are written apart
        let one = peer(&[(CommonName, "press 4,O=Example")]);
        assert_ne!(one, name);
        assert!(!peer(&[(CommonName, "a\nb")]).contains('\n'));
    }

    #[test]
    fn certificates_without_a_subject_are_known_apart() {
        let (one, two) = (certificate(&[]), certificate(&[]));
        assert_ne!(Peer::of(&one), Peer::of(&two));
        assert_eq!(Peer::of(&one), Peer::of(&one));
        assert!(Peer::of(b"no certificate").subject().starts_with("sha256="));
    }
}
