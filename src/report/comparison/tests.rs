use super::*;
use crate::compare::{Bytes, ImageFigures, Seconds, SilhouetteError, needed};
use crate::deviation::Deviation;
use crate::difference::Angles;
use crate::model::Representation;

fn image(error: f64) -> ImageFigures {
    ImageFigures {
        mean_error: error * 0.1,
        rms_error: error * 0.3,
        max_error: error * 20.0,
        psnr: -20.0 * libm::log10(error * 0.3),
        relmse: error * error,
        ssim: 1.0 - error,
        flip: error,
        hdrflip: error * 1.4,
        normal_degrees: Some(Angles { max: error * 900.0, x: 0, y: 0, mean: error * 40.0 }),
        same_object: 1.0 - error * 0.1,
    }
}

/// Made up: of the exact method for error 0.
fn method(kind: Representation, triangles: usize, error: f64) -> MethodFigures {
    let is_exact = kind == Representation::Exact;
    let max = if is_exact { 3.1e-16 } else { error };
    let seconds_of = Seconds { build: triangles as f64 * 1e-6, render: 1.3, deviation: 2.0 };
    let bytes_of = Bytes { geometry: triangles * 200, acceleration: triangles * 64, plain: triangles * 18 };
    MethodFigures {
        method: kind.to_string(),
        noise: false,
        triangles,
        patches: if is_exact { triangles * 3 } else { triangles },
        deviation: Some(Deviation {
            max,
            bound: max * 1.004,
            mean: max * 0.2,
            normal_max_degrees: max.sqrt() * 60.0,
            normal_mean_degrees: max.sqrt() * 8.0,
        }),
        deviation_error: None,
        silhouette: Some(SilhouetteError { max: error * 500.0, mean: error * 60.0 }),
        image: (!is_exact).then(|| image(0.003 + error)),
        seconds: seconds_of.build + seconds_of.render,
        seconds_of,
        bytes: bytes_of.geometry + bytes_of.acceleration,
        bytes_of,
        kind,
    }
}

fn scene_of(methods: Vec<MethodFigures>) -> SceneFigures {
    let needed = needed(&methods);
    SceneFigures { scene: "<bent> & \"twisted\".toml".into(), size: [640, 480], spp: 16, methods, needed }
}

/// The exact method, noise, and others.
fn all() -> SceneFigures {
    let mut methods = vec![method(Representation::Exact, 768, 0.0)];
    methods.push(MethodFigures { noise: true, image: Some(image(0.003)), ..methods[0].clone() });
    for level in 0..5_u32 {
        let split = 4_usize.pow(level);
        methods.push(method(Representation::Pointwise { level }, 768 * split, 0.014 / split as f64));
    }
    for (tolerance, triangles, error) in
        [(2e-3, 1_930, 9.1e-4), (2e-4, 12_600, 9.4e-5), (2e-5, 98_304, 9.9e-6)]
    {
        methods.push(method(Representation::Adaptive { tolerance }, triangles, error));
    }
    scene_of(methods)
}

fn pictures(figures: &SceneFigures) -> Vec<MethodPictures> {
    let of = |(index, method): (usize, &MethodFigures)| MethodPictures {
        png: format!("picture {index}").into_bytes(),
        heat_map: method.image.is_some().then(|| format!("heat map {index}").into_bytes()),
    };
    figures.methods.iter().enumerate().map(of).collect()
}

fn page_of(figures: &SceneFigures) -> String {
    comparison_page(&[ShownScene { figures, pictures: &pictures(figures) }]).unwrap()
}

#[test]
fn all_methods_are_on_the_page() {
    let figures = all();
    let page = page_of(&figures);
    for method in &figures.methods {
        // in the list, but for the exact one, and in both tables
        let listed = usize::from(method.image.is_some());
        let shown = |open: &str, close: &str| page.matches(&format!("{open}{}{close}", name(method))).count();
        assert_eq!(shown("<th scope=\"row\">", "</th>"), 2, "{}", method.method);
        assert_eq!(shown("\">", "</option>") + shown("selected>", "</option>"), listed, "{}", method.method);
    }
    for part in [
        "exact, other seed (noise)",
        // rounded up
        "1.400e-2</td><td class=\"number\">1.406e-2",
        "5.469e-5</td><td class=\"number\">5.491e-5",
        "pointwise:0</span>",
        "12,288",
        "is off by up to 1.40 % of its diagonal and 7.00 px at the silhouette",
        "From level 2 on, with 12,288 triangles, the silhouette is within a pixel",
        "2,304 patches for 768 triangles deviate by 3.1e-16 of the diagonal, which is rounding",
        "silhouette within 0.01 px",
        "extrapolation",
    ] {
        assert!(page.contains(part), "{part} is not in the page");
    }
    assert_eq!(page.matches("<svg").count(), 5);
    // each picture and each heat map once
    assert_eq!(page.matches("data:image/png;base64,").count(), 2 * figures.methods.len() - 1);
    assert!(page.contains("&lt;bent&gt; &amp; &quot;twisted&quot;.toml") && !page.contains("<bent>"));
    assert!(!page.contains("http"), "no network");
}

#[test]
fn what_is_not_known_is_told() {
    let mut figures = all();
    let last = figures.methods.last_mut().unwrap();
    last.deviation = None;
    last.deviation_error = Some("pieces < do not match".into());
    last.silhouette = None;
    let page = page_of(&figures);
    assert!(page.contains("pieces &lt; do not match") && page.contains("only one has any"));
    assert!(page.contains("adaptive 2e-5: not known, not drawn"));
    // one picture is missing
    let some = pictures(&figures);
    let error =
        comparison_page(&[ShownScene { figures: &figures, pictures: &some[1..] }]).unwrap_err().to_string();
    assert!(error.contains("9 pictures of 10 methods"), "{error}");
}

#[test]
fn few_methods_and_errors_of_zero_make_a_page() {
    let exact = method(Representation::Exact, 768, 0.0);
    let level = |level, error| method(Representation::Pointwise { level }, 768, error);
    let zero = |mut method: MethodFigures| {
        method.deviation = Some(Deviation {
            max: 0.0,
            bound: 0.0,
            mean: 0.0,
            normal_max_degrees: 0.0,
            normal_mean_degrees: 0.0,
        });
        method.silhouette = Some(SilhouetteError { max: 0.0, mean: 0.0 });
        method.image = method.image.map(|_| ImageFigures { psnr: f64::INFINITY, ..image(0.0) });
        method
    };
    let noise = MethodFigures { noise: true, image: Some(image(0.003)), ..exact.clone() };
    let empty = MethodFigures { triangles: 0, patches: 0, bytes: 0, seconds: 0.0, ..level(0, f64::NAN) };
    for methods in [
        vec![],
        vec![exact.clone()],
        vec![exact.clone(), noise.clone()],
        vec![exact.clone(), level(0, 0.01)],
        vec![zero(exact.clone()), zero(noise.clone()), zero(level(0, 0.0))],
        vec![exact.clone(), zero(noise), zero(level(0, 0.0)), level(1, 1e-300), level(2, 1e300)],
        vec![zero(exact), zero(empty.clone()), empty],
    ] {
        let page = page_of(&scene_of(methods));
        for broken in ["inf\"", "NaN"] {
            let at = page.find(broken).map(|at| &page[at.saturating_sub(200)..at + 5]);
            assert_eq!(at, None);
        }
    }
    let mut figures = all();
    figures.methods[3] = zero(figures.methods[3].clone());
    assert!(page_of(&figures).contains("pointwise 1: zero or below the axis, at the lower edge"));
}
