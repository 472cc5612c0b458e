//! Pictures: rendered, saved and compared.

use std::borrow::Cow;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trimray::cli::embedded;
use trimray::film::{
    Aov, Area, Image, LayeredChannel, LayeredPicture, Numbers, Part, PictureLimits, Recorded, SampleKind,
    Window, encode_png, read_layers_within, write_exr, write_png,
};
use trimray::identity::PictureIdentity;
use trimray::memory::MemoryLimit;
use trimray::output::check_writable;
use trimray::render::{RenderControl, Rendered};
use trimray::scene::{Choice, SceneDescription, validate_film};
use trimray::shade::{Camera, IntegratorKind};

use crate::errors::{cli_error, input_error, output_error, render_error, value_error};
use crate::scene::Scene;
use crate::wait::interruptible;

/// A picture as it was rendered.
#[pyclass(frozen, module = "trimray._trimray")]
pub(crate) struct Picture {
    image: Image,
    scene: Py<Scene>,
    /// The scene with the settings that the picture was rendered by.
    description: SceneDescription,
    camera: Camera,
    /// The least and the greatest number of samples of a pixel.
    #[pyo3(get)]
    samples: [u32; 2],
}

/// What may be set for one picture, in place of what the scene says.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Settings {
    size: Option<[u32; 2]>,
    crop: Option<[u32; 4]>,
    spp: Option<u32>,
    max_depth: Option<i32>,
    seed: Option<u64>,
    integrator: Option<String>,
    aovs: Option<Vec<String>>,
    threads: usize,
    time_limit: Option<f64>,
}

impl Settings {
    fn apply(&self, scene: &mut SceneDescription) -> PyResult<()> {
        let SceneDescription { film, render, .. } = scene;
        film.size = self.size.unwrap_or(film.size);
        film.crop = self.crop.or(film.crop);
        render.spp = self.spp.unwrap_or(render.spp);
        render.max_depth = self.max_depth.unwrap_or(render.max_depth);
        render.seed = self.seed.unwrap_or(render.seed);
        if render.spp == 0 || render.max_depth < -1 {
            return Err(value_error("spp: must be at least 1, and max_depth at least -1"));
        }
        if let Some(name) = &self.integrator {
            render.integrator = IntegratorKind::from_name(name).map_err(input_error)?;
        }
        if let Some(names) = &self.aovs {
            let aovs = names.iter().map(|name| Aov::from_name(name));
            render.aovs = aovs.collect::<Result<_, _>>().map_err(input_error)?;
        }
        validate_film(film).map_err(input_error)
    }
}

#[pymethods]
impl Picture {
    /// Renders a scene. `progress` is called now and then with the numbers of samples done and of all.
    #[new]
    fn new(
        py: Python<'_>,
        scene: Bound<'_, Scene>,
        settings: Settings,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let Scene { description, built } = scene.get();
        let mut description = description.clone();
        settings.apply(&mut description)?;
        let camera = Camera::try_new(&built.camera, description.film.size)
            .map_err(|error| input_error(format!("[camera]: {error}")))?;
        let limit = settings.time_limit.map(Duration::try_from_secs_f64).transpose().map_err(value_error)?;
        let (done, all) = (AtomicU64::new(0), AtomicU64::new(0));
        let tell = |samples, total| {
            done.fetch_max(samples, Ordering::Relaxed);
            all.store(total, Ordering::Relaxed);
        };
        let render = |cancel: &_| {
            let control = RenderControl {
                threads: settings.threads,
                deadline: limit.map(|limit| Instant::now() + limit),
                progress: &tell,
                memory: description.memory,
                ..RenderControl::new(cancel)
            };
            built.render(&camera, &description.film, &description.render, &control)
        };
        let call = |py: Python<'_>| {
            let (samples, total) = (done.load(Ordering::Relaxed), all.load(Ordering::Relaxed));
            progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (samples, total)).map(drop))
        };
        let rendered = interruptible(py, render, call)?;
        let Rendered { image, samples, .. } = rendered.map_err(|error| render_error(&error))?;
        if all.load(Ordering::Relaxed) > 0 {
            call(py)?;
        }
        Ok(Self { image, scene: scene.unbind(), description, camera, samples })
    }

    /// Each channel's full name and numbers, (height, width).
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyArray2<f32>>)>> {
        let Window { width, height, .. } = self.image.data_window();
        let shape = [height as usize, width as usize];
        let array = |channel: &trimray::film::Channel| {
            Ok((channel.name.clone(), channel.values.to_pyarray(py).reshape(shape)?))
        };
        self.image.channels().iter().map(array).collect()
    }

    /// Left, top, width and height of the pixels that there are, and width and height of the whole.
    fn window(&self) -> ([u32; 4], [u32; 2]) {
        let Window { x, y, width, height } = self.image.data_window();
        ([x, y, width, height], self.image.display_size())
    }

    /// Writes the file that the program would write.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        check_writable(&path).map_err(|error| output_error(&error))?;
        let written = match ending(&path).as_str() {
            "exr" => py.detach(|| {
                let identity = PictureIdentity::new(&self.description, &self.scene.get().built);
                write_exr(&path, &self.image, &identity.header(&self.description, &self.camera))
            }),
            "png" => py.detach(|| write_png(&path, &self.image)),
            _ => {
                return Err(input_error(format!(
                    "{}: unknown kind of picture (valid: .exr, .png)",
                    path.display()
                )));
            }
        };
        written.map_err(|error| output_error(&error))
    }

    /// The bytes of a tone-mapped preview.
    fn png(&self, py: Python<'_>) -> PyResult<Cow<'static, [u8]>> {
        Ok(py.detach(|| encode_png(&self.image)).map_err(input_error)?.into())
    }
}

/// A path's ending in small letters.
fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// A picture to compare: a file, one that was rendered, or an array of shape (height, width, channels), linear.
#[derive(FromPyObject)]
pub(crate) enum Compared<'py> {
    Rendered(Bound<'py, Picture>),
    Array(PyReadonlyArray3<'py, f32>),
    File(PathBuf),
}

impl Compared<'_> {
    fn read(&self, py: Python<'_>, limits: PictureLimits) -> PyResult<LayeredPicture> {
        match self {
            Self::File(path) => py.detach(|| read_layers_within(path, limits)).map_err(input_error),
            Self::Rendered(picture) => {
                let image = &picture.get().image;
                let Window { x, y, width, height } = image.data_window();
                let corner = |corner: u32| i32::try_from(corner).map_err(value_error);
                let data = Area { x: corner(x)?, y: corner(y)?, width, height };
                let [width, height] = image.display_size();
                let channels =
                    image.channels().iter().map(|channel| real(&channel.name, channel.values.clone()));
                Ok(layered(Area { x: 0, y: 0, width, height }, data, channels.collect()))
            }
            Self::Array(array) => {
                let &[height, width, count] = array.shape() else {
                    return Err(value_error("a picture has rows"));
                };
                let names: &[&str] = match count {
                    1 => &["Y"],
                    3 => &["R", "G", "B"],
                    4 => &["R", "G", "B", "A"],
                    _ => return Err(value_error(format!("a picture has 1, 3 or 4 channels, not {count}"))),
                };
                let side = |side: usize| u32::try_from(side).map_err(value_error);
                let data = Area { x: 0, y: 0, width: side(width)?, height: side(height)? };
                let values = array.as_array();
                let of_channel =
                    |c: usize| values.slice(numpy::ndarray::s![.., .., c]).iter().copied().collect();
                let channels = names.iter().enumerate().map(|(c, name)| real(name, of_channel(c)));
                Ok(layered(data, data, channels.collect()))
            }
        }
    }
}

fn real(name: &str, values: Vec<f32>) -> LayeredChannel {
    LayeredChannel { name: name.to_owned(), kind: SampleKind::Float, numbers: Numbers::Real(values) }
}

fn layered(display: Area, data: Area, channels: Vec<LayeredChannel>) -> LayeredPicture {
    let parts = vec![Part { name: None, data, channels }];
    let (recorded, notes) = (Recorded::default(), Vec::new());
    LayeredPicture { format: "OpenEXR", display, parts, srgb_encoded: false, recorded, notes }
}

/// Compares a picture with a reference, as `trimray diff` with these flags does: its JSON, and the map of each metric that has one,
/// the absolute difference last.
#[pyfunction]
pub(crate) fn diff<'py>(
    py: Python<'py>,
    reference: Compared<'py>,
    test: Compared<'py>,
    names: [OsString; 2],
    flags: Vec<OsString>,
) -> PyResult<(String, Bound<'py, PyDict>)> {
    let limits = PictureLimits { memory: MemoryLimit::of_machine(), ..Default::default() };
    let pictures = [reference.read(py, limits)?, test.read(py, limits)?];
    let (found, json) =
        py.detach(|| embedded::diff_pictures(pictures, names, flags)).map_err(|error| cli_error(&error))?;
    let maps = PyDict::new(py);
    let of_metrics = found.metrics.into_iter().filter_map(|metric| metric.map.map(|map| (metric.name, map)));
    for (name, map) in of_metrics.chain([("absolute", found.errors)]) {
        let [width, height] = map.size;
        maps.set_item(name, map.values.into_pyarray(py).reshape([height, width])?)?;
    }
    Ok((json, maps))
}
