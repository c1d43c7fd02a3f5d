//! What is known of drivers everywhere: the files of the folder expectations/.

use ash::vk::DriverId;

use crate::check::expectations::{Expectations, ExpectationsError};

/// Files, and the drivers that they are for.
const FILES: [(&[DriverId], &str, &str); 2] = [
    (&[DriverId::MESA_LLVMPIPE], "expectations/lavapipe.toml", include_str!("../../../expectations/lavapipe.toml")),
    (
        &[DriverId::GOOGLE_SWIFTSHADER],
        "expectations/swiftshader.toml",
        include_str!("../../../expectations/swiftshader.toml"),
    ),
];

impl Expectations {
    /// The declarations that come with the program for a driver (`VkDriverId`).
    ///
    /// # Errors
    /// See [`ExpectationsError`]: never, as a test holds.
    pub fn built_in(driver_id: i32) -> Result<Self, ExpectationsError> {
        let of_driver = FILES.iter().filter(|(ids, ..)| ids.iter().any(|id| id.as_raw() == driver_id));
        let mut all = Self::default();
        for (_, file, text) in of_driver {
            all.expected.extend(Self::parse(text, file)?.expected);
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_files_are_good() {
        for (ids, file, text) in FILES {
            let declared = Expectations::parse(text, file).unwrap();
            for id in ids {
                assert_eq!(Expectations::built_in(id.as_raw()).unwrap(), declared);
            }
        }
        assert_eq!(Expectations::built_in(0).unwrap(), Expectations::default());
    }
}
