//! One scene's test.

use std::time::Instant;

use super::folder::SceneTest;
use super::judge::{JudgeSettings, Judgement, is_estimate, judge};
use super::picture::{MadePicture, MakeError, files_hash, make_picture};
use crate::difference::{Judge, why};
use crate::film::{Aov, LayeredPicture, PictureLimits, read_layers_within};
use crate::render::{RenderControl, RenderError};
use crate::scene::{SceneDescription, parse_scene};

/// The seed of pictures whose references have their variance, by default: another one than those of references.
pub const SEED: u64 = 4711;

/// How scenes are tested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestSettings {
    /// The seed where noise is judged; another one is taken for a reference of this seed.
    pub seed: u64,
    /// By what pictures are judged.
    pub judge: JudgeSettings,
    /// Bounds on the pictures that are read.
    pub pictures: PictureLimits,
}

impl Default for TestSettings {
    fn default() -> Self {
        Self { seed: SEED, judge: JudgeSettings::default(), pictures: PictureLimits::default() }
    }
}

/// What testing a scene gave.
#[derive(Debug)]
pub struct TestResult {
    /// Why it failed; nothing if it passed.
    pub failures: Vec<String>,
    /// What may explain it, and what else is odd.
    pub notes: Vec<String>,
    /// What comparing found, if there were two pictures.
    pub judgement: Option<Judgement>,
    /// The reference, if it can be read.
    pub reference: Option<LayeredPicture>,
    /// The picture, if the scene was rendered.
    pub picture: Option<MadePicture>,
    /// How long it took.
    pub seconds: f64,
}

impl TestResult {
    /// Whether the scene's picture is the reference's.
    #[must_use]
    pub const fn passes(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Renders a scene and judges it by its reference.
///
/// Whatever is wrong with scene or reference is a failure of the test. The layers rendered are those that the reference has.
///
/// # Errors
/// On the control's `cancel` alone: [`RenderError::Interrupted`].
pub fn run_test(
    test: &SceneTest,
    settings: &TestSettings,
    control: &RenderControl<'_>,
) -> Result<TestResult, RenderError> {
    let started = Instant::now();
    let mut result = TestResult {
        failures: Vec::new(),
        notes: Vec::new(),
        judgement: None,
        reference: None,
        picture: None,
        seconds: 0.0,
    };
    match run(test, settings, control, &mut result) {
        Ok(()) => {}
        Err(MakeError::Render(RenderError::Interrupted)) => return Err(RenderError::Interrupted),
        Err(error) => result.failures.push(error.to_string()),
    }
    result.seconds = started.elapsed().as_secs_f64();
    Ok(result)
}

fn run(
    test: &SceneTest,
    settings: &TestSettings,
    control: &RenderControl<'_>,
    result: &mut TestResult,
) -> Result<(), MakeError> {
    let mut scene = parse_scene(&test.scene)?;
    scene.pictures = settings.pictures;
    scene.memory = settings.pictures.memory;
    let reference = match read_layers_within(&test.reference, settings.pictures) {
        Ok(reference) => reference,
        Err(_) if !test.reference.exists() => {
            let (path, name) = (test.reference.display(), &test.name);
            result.failures.push(format!("there is no reference {path}; --bless {name} makes it"));
            return Ok(());
        }
        Err(error) => {
            result.failures.push(error.to_string());
            return Ok(());
        }
    };
    result.failures.extend(other_scene(test, &scene, &reference)?);
    let ztest = is_estimate(&reference);
    if ztest {
        let taken = reference.recorded.seed.as_deref() == Some(&*settings.seed.to_string());
        scene.render.seed = settings.seed.wrapping_add(u64::from(taken));
    }
    scene.render.aovs = layers_of(&reference);
    let made = make_picture(&scene, control);
    let reference = result.reference.insert(reference);
    let made = result.picture.insert(made?);
    if made.non_finite_samples > 0 {
        result.failures.push(format!("{} samples were not finite", made.non_finite_samples));
    }
    let picture = made.layers();
    let judged = judge(reference, &picture, &settings.judge);
    result.failures.extend(judged.failures.iter().cloned());
    result.notes.extend(judged.notes.iter().cloned());
    result.notes.extend(reasons(reference, &picture, &judged, !result.failures.is_empty()));
    result.judgement = Some(judged);
    Ok(())
}

/// That the reference was made from other files than the scene's.
fn other_scene(
    test: &SceneTest,
    scene: &SceneDescription,
    reference: &LayeredPicture,
) -> Result<Option<String>, MakeError> {
    let recorded = &reference.recorded;
    let Some(hash) = &recorded.reference_scene else { return Ok(None) };
    if *hash == files_hash(scene)? {
        return Ok(None);
    }
    let again = recorded.reference_command.clone().unwrap_or_else(|| format!("--bless {}", test.name));
    Ok(Some(format!("{} is of another scene; {again} makes it anew", test.reference.display())))
}

/// What the files record that may explain a failure; that scenes differ is told of those that pass too.
fn reasons(
    reference: &LayeredPicture,
    picture: &LayeredPicture,
    judged: &Judgement,
    failed: bool,
) -> Vec<String> {
    let [recorded, ours] = [&reference.recorded, &picture.recorded];
    let mut known = recorded.scene_hash.is_some() || recorded.settings.is_some();
    known &= failed || (recorded.scene_hash.is_some() && recorded.scene_hash != ours.scene_hash);
    if !known {
        return Vec::new();
    }
    let differ = judged.comparison.as_ref().is_some_and(|found| found.figures.max_error > 0.0);
    let mut told = why(recorded, ours, differ, judged.by == Judge::ZTest);
    // with estimates they are to
    told.retain(|line| judged.by != Judge::ZTest || !line.starts_with("the seeds differ"));
    told
}

/// The layers that have any of the reference's channels.
fn layers_of(reference: &LayeredPicture) -> Vec<Aov> {
    let has = |layer: &str| {
        let mut channels = reference.parts.iter().flat_map(|part| &part.channels);
        channels.any(|channel| channel.layer() == layer)
    };
    Aov::ALL.into_iter().filter(|aov| has(aov.name())).collect()
}
