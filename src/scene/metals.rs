//! Metals by name.

use serde::Deserialize;

/// Metals whose index is known.
#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum Metal {
    Aluminium,
    Chromium,
    Copper,
    Gold,
    Iridium,
    Mercury,
    Silver,
    Tungsten,
}

impl Metal {
    /// η and k where linear sRGB has its red, green and blue: means of the spectra of refractiveindex.info, as Mitsuba 3 takes them.
    pub fn index(self) -> [[f64; 3]; 2] {
        match self {
            Self::Aluminium => [[1.6575, 0.8804, 0.5212], [9.2238, 6.2695, 4.837]],
            Self::Chromium => [[4.3697, 2.9165, 1.6549], [5.2066, 4.2313, 3.7547]],
            Self::Copper => [[0.201, 0.9238, 1.1022], [3.9133, 2.4531, 2.1421]],
            Self::Gold => [[0.143, 0.3753, 1.4421], [3.983, 2.3856, 1.6034]],
            Self::Iridium => [[3.0863, 2.0822, 1.6179], [5.5922, 4.0671, 3.2673]],
            Self::Mercury => [[2.3989, 1.44, 0.9096], [6.3276, 4.3719, 3.4218]],
            Self::Silver => [[0.1553, 0.1167, 0.1384], [4.8284, 3.1222, 2.1469]],
            Self::Tungsten => [[4.3708, 3.3003, 2.9984], [3.5006, 2.6049, 2.2732]],
        }
    }
}
