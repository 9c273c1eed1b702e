//! Lobes against the formulas of the extensions' pages, in f64, with angles, tangents and powers as they stand there.

use std::f64::consts::PI;

use glam::DVec3;

use super::*;

fn directions() -> Vec<(DVec3, DVec3)> {
    let at = |cos: f64, phi: f64| {
        let sin = (1.0 - cos * cos).sqrt();
        DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    };
    let cosines = [(0.95, 0.3, 0.4), (0.6, 0.7, 2.8), (0.2, 0.5, 5.0), (0.15, 0.12, 3.3), (0.8, 0.82, 1.0)];
    cosines.into_iter().map(|(a, b, phi)| (at(a, 0.7), at(b, phi))).collect()
}

fn close(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs() + 1e-6, "{what}: {found}, not {expected}");
}

fn end(surface: &Surface) -> Stack {
    Stack::new(*surface, Averages::default())
}

fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// D and V of `KHR_materials_anisotropy`, D_GGX_anisotropic and V_GGX_anisotropic there.
fn anisotropic(at: f64, ab: f64, v: DVec3, l: DVec3) -> f64 {
    let h = (v + l).normalize();
    let a2 = at * ab;
    let f = DVec3::new(ab * h.x, at * h.y, a2 * h.z);
    let w2 = a2 / f.length_squared();
    let d = a2 * w2 * w2 / PI;
    let ggx_v = l.z * DVec3::new(at * v.x, ab * v.y, v.z).length();
    let ggx_l = v.z * DVec3::new(at * l.x, ab * l.y, l.z).length();
    d * 0.5 / (ggx_v + ggx_l)
}

#[test]
fn a_grain_is_that_of_its_page() {
    for (strength, rotation) in [(0.5_f64, 0.0_f64), (1.0, 0.9), (0.3, 2.0)] {
        let surface =
            Surface { metallic: 1.0, alpha: 0.2, anisotropy: strength as f32, tangent: rotation as f32, ..WHITE };
        let s = end(&surface);
        for (v, l) in directions() {
            let turned = |w: DVec3| {
                let (sin, cos) = rotation.sin_cos();
                DVec3::new(cos * w.x + sin * w.y, cos * w.y - sin * w.x, w.z)
            };
            let along = 0.2 * (1.0 - strength * strength) + strength * strength;
            let expected = anisotropic(along, 0.2, turned(v), turned(l));
            let (a, b) = (s.end(v.as_vec3()), s.end(l.as_vec3()));
            close("grain", f64::from(base::Reflection.value(&s, &a, &b).g()), expected, 1e-3);
        }
    }
}

#[test]
fn a_coat_is_that_of_its_page() {
    let s = end(&Surface { coat: 0.7, coat_alpha: 0.3, ..WHITE });
    for (v, l) in directions() {
        let fresnel = schlick(0.04, v.dot((v + l).normalize()));
        let expected = 0.7 * fresnel * anisotropic(0.3, 0.3, v, l);
        let (a, b) = (s.end(v.as_vec3()), s.end(l.as_vec3()));
        close("coat", f64::from(coat::Coating.value(&s, &a, &b).g()), expected, 1e-3);
    }
}

/// `KHR_materials_sheen`: D and V of Charlie with α = roughness².
fn charlie(alpha: f64, v: DVec3, l: DVec3) -> f64 {
    let h = (v + l).normalize();
    let d = (2.0 + 1.0 / alpha) * (1.0 - h.z * h.z).powf(0.5 / alpha) / (2.0 * PI);
    let t = (1.0 - alpha).powi(2);
    let mix = |x: f64, y: f64| x * (1.0 - t) + y * t;
    let fit = |x: f64| {
        let (a, b, c) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801));
        a / (1.0 + b * x.powf(c)) + mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967)
    };
    let lambda = |cos: f64| {
        if cos < 0.5 { fit(cos).exp() } else { (2.0 * fit(0.5) - fit(1.0 - cos)).exp() }
    };
    d / ((1.0 + lambda(v.z) + lambda(l.z)) * 4.0 * v.z * l.z)
}

#[test]
fn a_sheen_is_that_of_its_page_and_takes_what_it_reflects() {
    for alpha in [0.09, 0.3, 1.0] {
        let s = end(&Surface { sheen: Rgb::new(1.0, 0.5, 0.2), sheen_alpha: alpha, ..WHITE });
        for (v, l) in directions() {
            let (a, b) = (s.end(v.as_vec3()), s.end(l.as_vec3()));
            close("sheen", f64::from(sheen::Sheen.value(&s, &a, &b).g()), 0.5 * charlie(alpha.into(), v, l), 2e-3);
        }
        for cos in [0.9, 0.5, 0.2, 0.05] {
            let v = DVec3::new((1.0_f64 - cos * cos).sqrt(), 0.0, cos);
            let n: usize = 400;
            let mut albedo = 0.0;
            for k in 0..n * n {
                let (x, phi) = (((k % n) as f64 + 0.5) / n as f64, ((k / n) as f64 + 0.5) / n as f64 * PI);
                let z = x * x;
                let l = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z);
                albedo += charlie(alpha.into(), v, l) * z * 2.0 * x;
            }
            albedo *= 2.0 * PI / (n * n) as f64;
            let found = f64::from(sheen::albedo(alpha, cos as f32));
            assert!((found - albedo).abs() < 0.004, "α = {alpha}, cos {cos}: {found}, not {albedo}");
        }
    }
}

/// F_iridescence of `KHR_materials_iridescence` in one channel of XYZ → RGB, with the optical path of the paper.
fn iridescence(film_ior: f64, thickness: f64, f0: f64, cos1: f64) -> [f64; 3] {
    let ior_to_fresnel0 =
        |transmitted: f64, incident: f64| ((transmitted - incident) / (transmitted + incident)).powi(2);
    let cos2 = (1.0 - (1.0 / film_ior).powi(2) * (1.0 - cos1 * cos1)).sqrt();
    let r12 = schlick(ior_to_fresnel0(film_ior, 1.0), cos1);
    let t121 = 1.0 - r12;
    let base_ior = (1.0 + f0.sqrt()) / (1.0 - f0.sqrt());
    let r23 = schlick(ior_to_fresnel0(base_ior, film_ior), cos2);
    let phi = PI + if base_ior < film_ior { PI } else { 0.0 };
    let opd = 2.0 * film_ior * thickness * cos2;
    let r123 = r12 * r23;
    let rs = t121 * t121 * r23 / (1.0 - r123);
    let mut rgb = [r12 + rs; 3];
    let mut cm = rs - t121;
    for m in 1..=2 {
        cm *= r123.sqrt();
        let (phase, shift) = (2.0 * PI * opd * 1e-9 * f64::from(m), f64::from(m) * phi);
        let gauss = |val: f64, pos: f64, var: f64| {
            val * (2.0 * PI * var).sqrt() * (pos * phase + shift).cos() * (-phase * phase * var).exp() / 1.0685e-7
        };
        let x = gauss(5.4856e-13, 1.6810e6, 4.3278e9) + gauss(9.7470e-14, 2.2399e6, 4.5282e9);
        let y = gauss(4.4201e-13, 1.7953e6, 9.3046e9);
        let z = gauss(5.2481e-13, 2.2084e6, 6.6121e9);
        let matrix = [
            [3.2404542, -1.5371385, -0.4985314],
            [-0.9692660, 1.8760108, 0.0415560],
            [0.0556434, -0.2040259, 1.0572252],
        ];
        for (c, row) in rgb.iter_mut().zip(matrix) {
            *c += cm * 2.0 * (row[0] * x + row[1] * y + row[2] * z);
        }
    }
    rgb.map(|c| c.clamp(0.0, 1.0))
}

#[test]
fn a_film_is_that_of_its_page() {
    for (ior, thickness, f0) in [(1.3, 400.0, 0.04), (1.8, 250.0, 0.6), (1.33, 800.0, 0.1), (2.2, 120.0, 0.04)] {
        let film = Film { ior: ior as f32, thickness: thickness as f32, outside: 1.0 };
        for cos in [1.0, 0.8, 0.5, 0.2] {
            let expected = iridescence(ior, thickness, f0, cos);
            let found = film.reflectance(Rgb::splat(f0 as f32), cos as f32).to_array();
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((f64::from(found) - expected).abs() < 2e-4, "{ior} {thickness} {cos}: {found}, not {expected}");
            }
        }
    }
}

/// A quarter of a wave between equal phases dims, and half of one brightens, the green that the film is made for: from
/// the Airy formula at 550 nm, and no fit.
#[test]
fn a_film_dims_and_brightens_its_own_wavelength() {
    let green = |ior: f32, thickness: f32| Film { ior, thickness, outside: 1.0 }.reflectance(Rgb::splat(0.04), 1.0).g();
    let bare = 0.04;
    let quarter = green(1.22, 550.0 / 4.0 / 1.22);
    assert!(quarter < 0.35 * bare, "an antireflective film: {quarter}");
    let bright = green(2.2, 550.0 / 4.0 / 2.2);
    assert!(bright > 4.0 * bare, "a dielectric mirror: {bright}");
}

/// Facets with a grain: what the table has, by the midpoint rule over the hemisphere.
#[test]
fn albedos_with_a_grain_are_those_of_quadratures() {
    for (x, y) in [(0.6, 0.2), (1.0, 0.3), (0.3, 0.1)] {
        for (cos, phi) in [(0.9, 0.2), (0.5, 1.3), (0.2, 0.7)] {
            let sin = (1.0_f64 - cos * cos).sqrt();
            let v = DVec3::new(sin * f64::cos(phi), sin * f64::sin(phi), cos);
            let n: usize = 500;
            let (mut once, mut grazing) = (0.0, 0.0);
            for k in 0..n * n {
                let (z, phi) = (((k % n) as f64 + 0.5) / n as f64, ((k / n) as f64 + 0.5) / n as f64 * 2.0 * PI);
                let r = (1.0 - z * z).sqrt();
                let l = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                let g = anisotropic(x, y, v, l) * z;
                once += g;
                grazing += g * (1.0 - v.dot((v + l).normalize())).powi(5);
            }
            let per = 2.0 * PI / (n * n) as f64;
            let split = brushed::split(Facets { x: x as f32, y: y as f32 }, v.as_vec3());
            let (missing, grazing) = (1.0 - once * per, grazing * per);
            assert!((f64::from(split.missing) - missing).abs() < 0.006, "{x} {y} {v}: {split:?}, not {missing}");
            assert!((f64::from(split.grazing) - grazing).abs() < 0.003, "{x} {y} {v}: {split:?}, not {grazing}");
        }
    }
}

#[test]
fn light_passes_a_leaf_by_lamberts_law() {
    let color = Rgb::new(0.2, 0.9, 0.3);
    let leaf = Surface { passage: Passage::Leaf { fraction: 0.6, color }, alpha: 1.0, ..Surface::LAMBERT };
    let layered = Layered::new(&leaf);
    let (camera, light) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, -0.8));
    let f = layered.eval(Lobe::Continuous, camera, light).f;
    for i in 0..3 {
        close("through", f64::from(f[i]), 0.6 * f64::from(color[i]) / PI, 4e-3);
    }
    let f = layered.eval(Lobe::Continuous, camera, -light).f;
    close("back", f64::from(f.g()), 0.4 / PI, 4e-3);
}
