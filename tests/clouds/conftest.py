"""What the tests of files share."""

import pytest


@pytest.fixture(scope="session")
def crc32c():
    """The checksum of E57's pages."""

    def checksum(data):
        crc = 0xFFFFFFFF
        for byte in data:
            crc ^= byte
            for _ in range(8):
                crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
        return crc ^ 0xFFFFFFFF

    return checksum
