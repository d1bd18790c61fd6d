//! Baud rates of a serial line. 1200 is not among them: opening a Due at 1200 baud erases its sketch.

/// Baud rate at which a port may be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "u32", try_from = "u32")]
pub enum Baud {
    /// 9600 bit/s.
    B9600,
    /// 19200 bit/s.
    B19200,
    /// 38400 bit/s.
    B38400,
    /// 57600 bit/s.
    B57600,
    /// 115200 bit/s.
    B115200,
    /// 230400 bit/s.
    B230400,
    /// 250000 bit/s.
    B250000,
    /// 460800 bit/s.
    B460800,
    /// 500000 bit/s.
    B500000,
    /// 921600 bit/s.
    B921600,
    /// 1000000 bit/s.
    B1000000,
    /// 2000000 bit/s.
    B2000000,
}

impl Baud {
    /// All rates, in rising order.
    pub const ALL: [Self; 12] = [
        Self::B9600,
        Self::B19200,
        Self::B38400,
        Self::B57600,
        Self::B115200,
        Self::B230400,
        Self::B250000,
        Self::B460800,
        Self::B500000,
        Self::B921600,
        Self::B1000000,
        Self::B2000000,
    ];

    /// Rates that are tried when the data is unreadable, the usual ones first.
    pub const SCANNED: [Self; 7] =
        [Self::B115200, Self::B57600, Self::B9600, Self::B250000, Self::B230400, Self::B460800, Self::B921600];

    /// Bits per second.
    pub fn rate(self) -> u32 {
        match self {
            Self::B9600 => 9_600,
            Self::B19200 => 19_200,
            Self::B38400 => 38_400,
            Self::B57600 => 57_600,
            Self::B115200 => 115_200,
            Self::B230400 => 230_400,
            Self::B250000 => 250_000,
            Self::B460800 => 460_800,
            Self::B500000 => 500_000,
            Self::B921600 => 921_600,
            Self::B1000000 => 1_000_000,
            Self::B2000000 => 2_000_000,
        }
    }
}

impl From<Baud> for u32 {
    fn from(baud: Baud) -> Self {
        baud.rate()
    }
}

/// A rate that no port is opened at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BaudError {
    #[error("1200 baud erases the sketch of a Due and is never used; try 115200")]
    Erases,
    #[error("{0} is not a supported baud rate; choose one of {list}", list = Baud::ALL.map(|baud| baud.rate().to_string()).join(", "))]
    Unsupported(u32),
}

impl TryFrom<u32> for Baud {
    type Error = BaudError;

    fn try_from(rate: u32) -> Result<Self, BaudError> {
        if rate == 1200 {
            return Err(BaudError::Erases);
        }
        Self::ALL.into_iter().find(|baud| baud.rate() == rate).ok_or(BaudError::Unsupported(rate))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_port_can_be_opened_at_1200_baud() {
        assert!(Baud::ALL.iter().all(|baud| baud.rate() > 1200));
        assert_eq!(Baud::try_from(1200), Err(BaudError::Erases));
        for baud in Baud::ALL {
            assert_eq!(Baud::try_from(baud.rate()), Ok(baud));
        }
    }
}
