"""Certificates for tests of clusters: an authority, and who it vouches for, for a while or until yesterday."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

FILES = ("ca.pem", "cert.pem", "key.pem")


class Authority:
    """An authority of a test, whose files lie in a folder."""

    def __init__(self, folder: Path, name: str = "authority") -> None:
        self._folder, self._name = folder, name
        self._key = ec.generate_private_key(ec.SECP256R1())
        self.file = self._written(name, self._signed(name, self._key, authority=True), self._key)[0]

    def vouched(self, name: str, *, days: float = 1.0) -> tuple[Path, Path]:
        """Return the files of a certificate that is valid for so many days from now on, and of its key."""
        key = ec.generate_private_key(ec.SECP256R1())
        return self._written(name, self._signed(name, key, days=days), key)

    def _signed(
        self, name: str, key: ec.EllipticCurvePrivateKey, *, authority: bool = False, days: float = 1.0
    ) -> x509.Certificate:
        now = datetime.now(UTC)
        names = [x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, one)]) for one in (name, self._name)]
        return (
            x509.CertificateBuilder()
            .subject_name(names[0])
            .issuer_name(names[1])
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(days=2))
            .not_valid_after(now + timedelta(days=days))
            .add_extension(x509.BasicConstraints(ca=authority, path_length=None), critical=True)
            .sign(self._key, hashes.SHA256())
        )

    def _written(self, name: str, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> tuple[Path, Path]:
        files = self._folder / f"{name}.pem", self._folder / f"{name}-key.pem"
        files[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
        files[1].write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
            )
        )
        return files

    def folder(self, name: str, *, days: float = 1.0) -> Path:
        """Return a folder with ca.pem, and with cert.pem and key.pem of a certificate valid for so many days."""
        folder = self._folder / f"{self._name}-{name}"
        folder.mkdir()
        for source, copy in zip((self.file, *self.vouched(name, days=days)), FILES, strict=True):
            (folder / copy).write_bytes(source.read_bytes())
        return folder
