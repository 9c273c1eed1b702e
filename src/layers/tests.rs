//! Expressions against paths spelled by hand.

use super::{alphabet::Letter, *};
use crate::scene::{
    bsdf::ScatterEvent,
    camera::{Camera, Sensor},
    geometry::Geometry,
    material::Material,
};

/// A scene with nothing but materials: the third and the fourth have one name.
fn scene() -> Scene {
    let sensor = Sensor { width: 1, height: 1, padding: 0 };
    let camera = Camera::look_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 1.0, sensor);
    let materials = ["wall", "lamp", "glass", "glass"].map(|name| Material::diffuse(name, Rgb::ONE));
    Scene::new(Geometry::default(), materials.to_vec(), &[], camera)
}

/// The symbols of a path as `C DR ST:glass L:lamp` writes it.
fn spelled(tags: &Tags, names: &[&str], path: &str) -> Vec<u8> {
    let symbol = |word: &str| {
        let (kind, name) = word.split_once(':').unwrap_or((word, ""));
        let kind = match kind {
            "C" => Letter::Camera,
            "L" => Letter::Surface,
            "P" => Letter::Lamp,
            "H" => Letter::Sky,
            _ => {
                let event = match &kind[..1] {
                    "D" => ScatterEvent::Diffuse,
                    "G" => ScatterEvent::Glossy,
                    _ => ScatterEvent::Specular,
                };
                Letter::of_event(event, &kind[1..] == "T")
            }
        };
        let tag = names.iter().position(|n| *n == name).map_or(0, |i| i as u8 + 1);
        let symbols: Vec<u8> = tags.symbols().collect();
        let kinds = symbols.len() / (names.len() + 1);
        symbols[kind as usize + kinds * usize::from(tag)]
    };
    path.split(' ').map(symbol).collect()
}

fn matches(expression: &str, path: &str) -> bool {
    let expression = Expression::parse(expression).unwrap();
    let names = expression.names();
    let tags = Tags::new(names.iter().copied(), &scene()).unwrap();
    let mut known: Vec<&str> = Vec::new();
    names.into_iter().for_each(|name| {
        if !known.contains(&name) {
            known.push(name);
        }
    });
    expression.compile(&tags).unwrap().matches(&spelled(&tags, &known, path))
}

#[test]
fn expressions_mean_what_their_description_says() {
    let caustic = "C DR ST ST L";
    for (expression, path, expected) in [
        ("CL", "C L", true),
        ("CL", "C DR L", false),
        ("C.*[DG]S+L", caustic, true),
        ("C.*[DG]S+L", "C SR DR L", false),
        ("C.*[DG]S+L", "C SR GR ST ST P", true),
        ("CDTTL", caustic, true),
        ("CDRTL", caustic, false),
        ("C D <TS>{2} L", caustic, true),
        ("CD<TS>{3,}L", caustic, false),
        ("CD<TS>{1,2}L", caustic, true),
        ("C[^S]*L", caustic, false),
        ("C[^S]*L", "C DR GR DT L", true),
        ("C(D|SS)+L", "C DR SR SR DR L", true),
        ("C(D|SS)+L", "C DR SR DR L", false),
        ("CD?L", "C L", true),
        ("CD<L point>", "C DR P", true),
        ("CD<L point>", "C DR L", false),
        ("CD[<L point><L sky>]", "C DR H", true),
        ("C<D'wall'>L", "C DR:wall L", true),
        ("C<D'wall'>L", "C DR L", false),
        ("C.*<T'glass'>.*L", "C DR:wall ST:glass L", true),
        ("CD<L'lamp'>", "C DR L:lamp", true),
        ("C[^<'wall'>]+L", "C DR:wall L", false),
        ("C[^<'wall'>]+L", "C DR L", true),
        ("C", "C L", false),
        ("CT?R?L", "C DT DR L", true),
    ] {
        assert_eq!(matches(expression, path), expected, "'{expression}' and '{path}'");
    }
}

#[test]
fn what_is_no_expression_is_refused_where_it_goes_wrong() {
    for (text, sentence) in [
        ("", "character 1 of '': an event is missing here, such as C, D, G, S, L or '.'"),
        ("CX", "character 2 of 'CX': 'X' is no event; these are C, D, G, S, L, R, T and '.'"),
        ("C(DL", "character 5 of 'C(DL': a ')' is missing"),
        ("CD)L", "character 3 of 'CD)L': there is no '(' for this ')'"),
        ("C[DL", "character 5 of 'C[DL': a ']' is missing"),
        ("C[]L", "character 4 of 'C[]L': the brackets are empty"),
        ("C<TS", "character 5 of 'C<TS': a '>' is missing"),
        ("C<S'a>L", "character 4 of 'C<S'a>L': the name has no closing quote"),
        ("CD**L", "character 4 of 'CD**L': this is repeated already"),
        ("CD{3,2}L", "character 8 of 'CD{3,2}L': the second number is smaller than the first"),
        ("CD{999}L", "character 6 of 'CD{999}L': no path has more than 256 vertices"),
        (
            "C<L lamp>",
            "character 5 of 'C<L lamp>': 'lamp' is no kind of light; these are surface, point, spot, sun, sky",
        ),
        ("C|", "character 3 of 'C|': an event is missing here, such as C, D, G, S, L or '.'"),
        ("C[^'x']L", "character 4 of 'C[^'x']L': ''' is no event; these are C, D, G, S, L, R, T and '.'"),
    ] {
        assert_eq!(Expression::parse(text).map(|_| ()).map_err(|e| e.to_string()), Err(sentence.to_owned()));
    }
    let deep = format!("{}C{}", "(".repeat(100_000), ")".repeat(100_000));
    assert!(Expression::parse(&deep).unwrap_err().to_string().ends_with("groups are 50 deep at most"));
}

#[test]
fn names_are_looked_up_and_automata_bounded() {
    let compile = |text: &str| {
        let expression = Expression::parse(text).unwrap();
        let tags = Tags::new(expression.names(), &scene()).map_err(LayerError::from)?;
        expression.compile(&tags).map(|_| ()).map_err(LayerError::from)
    };
    assert_eq!(compile("C.*<S'glass'>L"), Ok(()));
    let unknown = compile("C<D'door'>L").unwrap_err().to_string();
    assert_eq!(unknown, "no material of the scene is called 'door'; 'pathspace info' lists them");
    assert!(compile("C((.{200}){200}){200}L").unwrap_err().to_string().contains("too many parts"));
}

/// What a fuzzer found: a terminal obeys control characters.
#[test]
fn what_is_wrong_is_said_on_one_line() {
    for text in ["\nCL(", "C<D'\u{1b}[31m'>["] {
        let said = Expression::parse(text).unwrap_err().to_string();
        assert!(!said.contains(|c: char| c.is_control() || c == '\u{2028}'), "{said:?}");
    }
    let said = Tags::new(["a\tname"], &scene()).unwrap_err().to_string();
    assert!(said.contains("a\u{fffd}name"), "{said:?}");
}

#[test]
fn classes_take_every_path_that_there_can_be() {
    let tags = Tags::default();
    let Group { sorting: Sorting::Expressions(matchers), names } = classes(&tags).unwrap() else {
        panic!("expressions")
    };
    let class = |path: &str| {
        let symbols = spelled(&tags, &[], path);
        matchers.iter().position(|m| m.matches(&symbols)).map(|i| names[i].as_str())
    };
    for (path, expected) in [
        ("C L", "emission"),
        ("C H", "emission"),
        ("C DR L", "direct"),
        ("C GR P", "direct"),
        ("C DR ST ST L", "caustics"),
        ("C ST ST DR SR L", "caustics"),
        ("C ST ST DR L", "transmission"),
        ("C ST ST H", "transmission"),
        ("C SR DR L", "mirrors"),
        ("C SR L", "mirrors"),
        ("C DR GR L", "glossy"),
        ("C DR DR L", "indirect"),
        ("C DR SR DR L", "indirect"),
    ] {
        assert_eq!(class(path), Some(expected), "{path}");
    }
}
