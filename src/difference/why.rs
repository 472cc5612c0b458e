//! What two files say of how their pictures were made, and so why they may differ.

use serde_json::Value;

use crate::film::Recorded;

/// Most settings that are named; the rest is counted.
const MOST: usize = 10;

/// Reasons in plain words for the pictures to differ, by what their files record. Nothing if neither records anything.
///
/// `differ` is whether they do, and `ztest` whether their noise is to be independent.
#[must_use]
pub fn why(reference: &Recorded, test: &Recorded, differ: bool, ztest: bool) -> Vec<String> {
    let mut said = Vec::new();
    let known = |recorded: &Recorded| recorded.scene_hash.is_some() || recorded.settings.is_some();
    match (known(reference), known(test)) {
        (false, false) => return said,
        (true, false) => said.push("the test does not say how it was made, the reference does".to_owned()),
        (false, true) => said.push("the reference does not say how it was made, the test does".to_owned()),
        (true, true) => {}
    }
    let both =
        |field: fn(&Recorded) -> &Option<String>| field(reference).as_deref().zip(field(test).as_deref());
    let mut same = known(reference) && known(test);
    if let Some((a, b)) = both(|recorded| &recorded.version).filter(|(a, b)| a != b) {
        said.push(format!("the versions of trimray differ: {a} against {b}"));
        same = false;
    }
    let scene = both(|recorded| &recorded.scene_hash);
    if let Some((a, b)) = scene.filter(|(a, b)| a != b) {
        said.push(format!(
            "the scenes differ (shapes, materials, lights, camera or size): hash {} against {}",
            shortened(a),
            shortened(b)
        ));
        same = false;
    }
    let seeds = both(|recorded| &recorded.seed);
    if let Some((a, b)) = seeds.filter(|(a, b)| a != b) {
        said.push(format!("the seeds differ ({a} against {b}), and so does the noise"));
        same = false;
    }
    let samples = both(|recorded| &recorded.spp);
    if let Some((a, b)) = samples.filter(|(a, b)| a != b) {
        said.push(format!("the samples per pixel differ: {a} against {b}"));
        same = false;
    }
    let equal = |pair: Option<(&str, &str)>| pair.is_some_and(|(a, b)| a == b);
    if ztest && equal(seeds) {
        said.push(format!(
            "the seeds are equal ({}), but --ztest supposes independent noise: render one with another --seed",
            seeds.map_or("", |(seed, _)| seed)
        ));
    } else if equal(seeds) && equal(samples) && scene.is_some() && !equal(scene) {
        said.push(
            "the seeds and samples are equal: where the scenes look the same, so should the noise".to_owned(),
        );
    }
    if let Some((a, b)) = both(|recorded| &recorded.settings) {
        let differing = settings(a, b);
        same &= differing.is_empty();
        said.extend(differing);
    }
    if same && differ {
        said.push(
            "both say that they are the same picture (scene, settings, seed, samples, version): the programs or machines differ, \
             or a file was changed"
                .to_owned(),
        );
    }
    said
}

/// The settings that differ, with both values, but for seed and samples, which are told already.
fn settings(a: &str, b: &str) -> Vec<String> {
    let (Ok(a), Ok(b)) = (serde_json::from_str(a), serde_json::from_str(b)) else {
        return vec!["the settings that a file records are not JSON".to_owned()];
    };
    let mut found = Vec::new();
    walk("", &a, &b, &mut found);
    found.retain(|(key, ..)| key != "render.seed" && key != "render.spp");
    let more = found.len().saturating_sub(MOST);
    let mut said: Vec<_> = found
        .iter()
        .take(MOST)
        .map(|(key, a, b)| format!("setting {key}: {} against {}", shown(*a), shown(*b)))
        .collect();
    if more > 0 {
        said.push(format!("and {more} settings more"));
    }
    said
}

/// All leaves that differ, or are in one alone, with their dotted keys.
fn walk<'v>(
    key: &str,
    a: &'v Value,
    b: &'v Value,
    found: &mut Vec<(String, Option<&'v Value>, Option<&'v Value>)>,
) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (a, b) {
        (Value::Object(first), Value::Object(second)) => {
            for (name, value) in first {
                match second.get(name) {
                    Some(other) => walk(&below(name), value, other, found),
                    None => found.push((below(name), Some(value), None)),
                }
            }
            let new = second.iter().filter(|(name, _)| !first.contains_key(*name));
            found.extend(new.map(|(name, value)| (below(name), None, Some(value))));
        }
        (Value::Array(first), Value::Array(second))
            if first.len() == second.len()
                && first.iter().any(|value| value.is_object() || value.is_array()) =>
        {
            for (index, (value, other)) in first.iter().zip(second).enumerate() {
                walk(&format!("{key}[{index}]"), value, other, found);
            }
        }
        _ if a != b => found.push((key.to_owned(), Some(a), Some(b))),
        _ => {}
    }
}

fn shown(value: Option<&Value>) -> String {
    value.map_or_else(|| "nothing".to_owned(), |value| shortened(&value.to_string()))
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(seed: u32, settings: &str) -> Recorded {
        Recorded {
            software: None,
            version: Some("0.1.0".into()),
            scene_hash: Some("abc".into()),
            seed: Some(seed.to_string()),
            spp: Some("16".into()),
            settings: Some(settings.into()),
            ..Recorded::default()
        }
    }

    #[test]
    fn differing_settings_are_named() {
        let a = recorded(
            0,
            r#"{"render":{"seed":0,"max_depth":8},"lights":[{"radiance":[1,1,1]}],"film":{"size":[4,4]}}"#,
        );
        let mut b = recorded(
            1,
            r#"{"render":{"seed":1,"max_depth":3},"lights":[{"radiance":[1,2,1]}],"film":{"size":[4,4]},"x":1}"#,
        );
        b.scene_hash = Some("def".into());
        let said = why(&a, &b, true, false).join("\n");
        for part in [
            "hash abc against def",
            "the seeds differ (0 against 1)",
            "setting render.max_depth: 8 against 3",
            "setting lights[0].radiance: [1,1,1] against [1,2,1]",
            "setting x: nothing against 1",
        ] {
            assert!(said.contains(part), "{part:?} is not in {said}");
        }
        assert!(!said.contains("render.seed") && !said.contains("size:"), "{said}");
    }

    #[test]
    fn what_should_be_equal_is_told() {
        let a = recorded(0, "{}");
        assert!(why(&a, &a, true, false).join("").contains("both say that they are the same picture"));
        assert_eq!(why(&a, &a, false, false), Vec::<String>::new());
        assert!(why(&a, &a, false, true).join("").contains("render one with another --seed"));
        assert_eq!(why(&Recorded::default(), &Recorded::default(), true, true), Vec::<String>::new());
        assert!(why(&a, &Recorded::default(), true, true).join("").contains("the test does not say"));
        let many = |value: u32| {
            let keys: Vec<_> = (0..15).map(|key| format!("\"k{key}\":{value}")).collect();
            recorded(0, &format!("{{{}}}", keys.join(",")))
        };
        let said = why(&many(1), &many(2), true, false);
        assert!(said.len() == 11 && said[10] == "and 5 settings more", "{said:?}");
    }
}
