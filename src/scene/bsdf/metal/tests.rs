//! Measured metals against a spectral integral with other tables and another program, and against published colours.

use super::*;
use crate::scene::bsdf::fresnel;

fn metal(symbol: &str) -> Metal {
    Metal::named(symbol).unwrap_or_else(|| panic!("{symbol}"))
}

/// Reflectances at 0°, 60° and 80°, and the cosine-weighted mean: the same η and κ, integrated every nanometre with the
/// CIE 1931 tables and the D65 of Mitsuba 3.9.1 and Fresnel's equations of its `conductor`, in Python.
const SPECTRAL: [(&str, [[f32; 3]; 4]); 11] = [
    ("Ag", [[0.9894, 0.9840, 0.9778], [0.9876, 0.9821, 0.9770], [0.9865, 0.9843, 0.9849], [0.9884, 0.9832, 0.9781]]),
    ("Al", [[0.9073, 0.9159, 0.9223], [0.8903, 0.9010, 0.9098], [0.8338, 0.8616, 0.8894], [0.8944, 0.9054, 0.9146]]),
    ("Au", [[1.0000, 0.7282, 0.3647], [1.0000, 0.7379, 0.4010], [0.9913, 0.8353, 0.6013], [0.9995, 0.7417, 0.4012]]),
    ("Co", [[0.6830, 0.6552, 0.6160], [0.6574, 0.6332, 0.6017], [0.6454, 0.6459, 0.6539], [0.6699, 0.6460, 0.6141]]),
    ("Cr", [[0.5496, 0.5560, 0.5542], [0.5286, 0.5350, 0.5402], [0.5388, 0.5471, 0.5901], [0.5410, 0.5476, 0.5524]]),
    ("Cu", [[0.9316, 0.6227, 0.5223], [0.9224, 0.6231, 0.5327], [0.9379, 0.7249, 0.6664], [0.9283, 0.6322, 0.5398]]),
    ("Fe", [[0.5297, 0.5132, 0.4942], [0.5129, 0.4984, 0.4853], [0.5450, 0.5387, 0.5519], [0.5251, 0.5103, 0.4965]]),
    ("Ni", [[0.6971, 0.6405, 0.5632], [0.6720, 0.6211, 0.5557], [0.6645, 0.6487, 0.6347], [0.6846, 0.6339, 0.5671]]),
    ("Pd", [[0.7327, 0.6969, 0.6524], [0.7079, 0.6759, 0.6391], [0.6959, 0.6919, 0.6946], [0.7199, 0.6884, 0.6511]]),
    ("Ti", [[0.6186, 0.5793, 0.5426], [0.5941, 0.5603, 0.5305], [0.5910, 0.5866, 0.5888], [0.6070, 0.5730, 0.5424]]),
    ("W", [[0.5159, 0.4963, 0.4674], [0.4962, 0.4796, 0.4554], [0.5089, 0.5062, 0.5021], [0.5082, 0.4913, 0.4666]]),
];

#[test]
fn reflectances_are_those_of_the_spectrum() {
    assert_eq!(Metal::all().map(Metal::symbol).collect::<Vec<_>>(), SPECTRAL.map(|(symbol, _)| symbol));
    for (symbol, expected) in SPECTRAL {
        let metal = metal(symbol);
        let at = |degrees: f32| metal.reflectance(degrees.to_radians().cos());
        for (found, expected) in [at(0.0), at(60.0), at(80.0), metal.mean()].into_iter().zip(expected) {
            // The renderer's colour matching functions are a fit.
            let error = (found - Rgb::from_array(expected)).abs().max_element();
            assert!(error < 4e-3, "{symbol}: {found}, not {expected:?}");
        }
    }
}

/// S. Lagarde 2011, *Feeding a physically based shading model*: silver, aluminium, gold, copper, chromium, nickel,
/// titanium and cobalt, by other measurements and other hands. Measurements of one metal differ by more than ours and
/// theirs do from any spectral integral.
#[test]
fn colours_are_about_those_of_another_list() {
    let list = [
        ("Ag", [0.972, 0.960, 0.915], 0.07),
        ("Al", [0.913, 0.922, 0.924], 0.01),
        ("Au", [1.0, 0.766, 0.336], 0.04),
        ("Cu", [0.955, 0.638, 0.538], 0.03),
        ("Cr", [0.549, 0.556, 0.554], 0.01),
        ("Ni", [0.660, 0.609, 0.526], 0.04),
        ("Ti", [0.542, 0.497, 0.449], 0.1),
        ("Co", [0.662, 0.655, 0.634], 0.03),
    ];
    for (symbol, expected, tolerance) in list {
        let found = metal(symbol).reflectance(1.0);
        let error = (found - Rgb::from_array(expected)).abs().max_element();
        assert!(error < tolerance, "{symbol}: {found}, not {expected:?}");
    }
}

#[test]
fn what_reflects_all_wavelengths_alike_is_grey() {
    for (eta, k) in [(1.5, 0.0), (0.2, 3.5), (2.8, 3.3)] {
        let table = Table::new(&[[300.0, eta, k], [900.0, eta, k]]);
        for cos in [0.0_f32, 0.25, 0.5, 1.0] {
            let expected = conductor(f64::from(cos), eta, k) as f32;
            let found = table.at(cos);
            assert!((found - Rgb::splat(expected)).abs().max_element() < 1e-5, "{eta}, {k}: {found}, not {expected}");
        }
    }
    let black = Table::new(&[[300.0, 1.0, 0.0], [900.0, 1.0, 0.0]]);
    assert!(black.at(0.7).max_element() < 1e-5);
}

#[test]
fn without_absorption_a_conductor_is_a_dielectric() {
    for (eta, cos) in [(1.5, 1.0), (1.5, 0.5), (1.5, 0.1), (2.4, 0.3), (1.33, 0.8)] {
        let expected = fresnel::dielectric(cos as f32, eta as f32);
        assert!((conductor(cos, eta, 0.0) as f32 - expected).abs() < 1e-5, "{eta}, {cos}");
    }
}

#[test]
fn between_its_cosines_the_table_is_right_to_three_digits() {
    for (metal, (symbol, data)) in Metal::all().zip(METALS) {
        let spectrum = spectrum(data);
        for i in 0..2000 {
            let cos = (f64::from(i) + 0.5) / 2000.0;
            let sum: DVec3 = spectrum.iter().map(|&(response, eta, k)| response * conductor(cos, eta, k)).sum();
            let exact = Rgb::from(sum.clamp(DVec3::ZERO, DVec3::ONE));
            let error = (metal.reflectance(cos as f32) - exact).abs().max_element();
            assert!(error < 5e-4, "{symbol} at {cos}: {error}");
        }
    }
}

#[test]
fn every_table_holds_the_visible_spectrum_in_order() {
    for (symbol, data) in METALS {
        let [first, last] = [data[0][0], data[data.len() - 1][0]];
        assert!(first <= 380.0 && last >= 780.0, "{symbol}");
        assert!(data.windows(2).all(|pair| pair[0][0] < pair[1][0]), "{symbol}");
        assert!(data.iter().flatten().all(|x| *x > 0.0), "{symbol}");
    }
}
