//! Metals by their complex index, and rough mirrors.

use crate::check::cases::layered::bodies;
use crate::check::cases::oracle::against_oracle;
use crate::check::probe::{Function, Words};
use crate::check::rng::Rng;
use crate::check::scenes::diffuse;
use crate::check::statistics::{relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle::conductor;
use crate::scene::{Bsdf, Conductor, Reflection, Surface};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "materials/conductor-fresnel",
        what: "reflectance of conductors, η and k from .001 to 100, at all angles",
        oracle: "Fresnel's equations with complex numbers in f64",
        quantity: "worst relative error",
        threshold: 2e-5,
        full_only: false,
        measure: conductor_fresnel,
    },
    Case {
        name: "materials/conductors",
        what: "bodies of metals by their complex index, and a rough mirror",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &bodies(&conductors())),
    },
];

fn conductors() -> [Surface; 4] {
    let index = |eta, k| Reflection::Index { eta, k };
    [
        (index([0.143, 0.375, 1.442], [3.983, 2.386, 1.603]), 0.15),
        (index([1.6575, 0.8804, 0.5212], [9.2238, 6.2695, 4.837]), 0.5),
        (Reflection::Constant([0.9, 0.6, 0.3]), 0.3),
        (index([1.5, 0.5, 3.0], [0.0, 0.5, 3.0]), 1.0),
    ]
    .map(|(reflection, roughness)| Surface {
        bsdf: Bsdf::Conductor(Conductor { reflection, roughness }),
        ..diffuse(0.0)
    })
}

fn conductor_fresnel(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(70);
    let mut number = |exponent: f32| ((rng.bits() >> 8) as f32 * 2f32.powi(-24)).powf(exponent);
    let inputs: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
        .map(|_| Words::of(&[number(2.0), 10f32.powf(5.0 * number(1.0) - 3.0), 10f32.powf(5.0 * number(1.0) - 3.0)]))
        .collect();
    let outputs = lab.function_in(&bodies(&conductors()), Function::Conductor, &inputs)?;
    let error = |(input, output): (&Words, &Words)| {
        let [cosine, eta, k, _] = input.x.map(f64::from);
        relative(f64::from(output.x[0]), conductor::fresnel(cosine, eta, k))
    };
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} interfaces", inputs.len())))
}
