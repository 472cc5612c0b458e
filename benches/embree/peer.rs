//! The program that traces with Embree: compiled, started and talked to.

use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use tempfile::TempDir;

use crate::common::rays::SinglePrecisionRay;
use crate::tessellate::Mesh;

/// Which of Embree's queries traces the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// `rtcIntersect1`.
    Intersect1,
    /// `rtcIntersect16`.
    Intersect16,
    /// `rtcIntersect16` with the flag for coherent rays.
    Coherent16,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Intersect1 => "intersect1",
            Self::Intersect16 => "intersect16",
            Self::Coherent16 => "coherent16",
        })
    }
}

/// A mesh that Embree has built.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PeerMesh {
    index: usize,
    /// Time of committing geometry and scene, one thread.
    pub(crate) build_seconds: f64,
    /// What Embree holds.
    pub(crate) bvh_bytes: u64,
    /// Vertices and indices.
    pub(crate) mesh_bytes: u64,
}

/// The running program.
#[derive(Debug)]
pub(crate) struct Peer {
    child: Child,
    commands: ChildStdin,
    answers: BufReader<ChildStdout>,
    folder: TempDir,
    /// Version of Embree, and whether its packets of 16 are native.
    pub(crate) version: String,
}

impl Peer {
    /// Compiles and starts it.
    pub(crate) fn start() -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|error| format!("no temporary folder: {error}"))?;
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/embree/peer.cpp");
        let program = folder.path().join("peer");
        let compiled = Command::new("g++")
            .args(["-O3", "-march=native", "-std=c++17", "-o"])
            .args([&program, &source])
            .arg("-lembree3")
            .output()
            .map_err(|error| {
                format!("g++ cannot be run ({error}); on Debian: apt-get install g++ libembree-dev")
            })?;
        if !compiled.status.success() {
            let messages = String::from_utf8_lossy(&compiled.stderr);
            return Err(format!(
                "{} does not compile; it needs Embree 3, on Debian: apt-get install libembree-dev\n{messages}",
                source.display()
            ));
        }
        let mut child = Command::new(&program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{} cannot be run: {error}", program.display()))?;
        let commands = child.stdin.take().ok_or("the program has no input")?;
        let answers = BufReader::new(child.stdout.take().ok_or("the program has no output")?);
        let mut peer = Self { child, commands, answers, folder, version: String::new() };
        peer.version = peer.answer("embree")?.join(" ");
        Ok(peer)
    }

    /// Hands over a mesh and builds it.
    pub(crate) fn add_mesh(&mut self, mesh: &Mesh) -> Result<PeerMesh, String> {
        let path = self.folder.path().join("mesh");
        let floats = mesh.vertices.iter().flat_map(|vertex| vertex.to_array()).map(f32::to_ne_bytes);
        let indices = mesh.triangles.iter().flatten().copied().map(u32::to_ne_bytes);
        write_numbers(&path, floats.chain(indices))?;
        let command = format!("mesh {} {} {}", path.display(), mesh.vertices.len(), mesh.triangles.len());
        let answer = self.ask(&command, "mesh")?;
        Ok(PeerMesh {
            index: number(&answer, 0)?,
            build_seconds: number(&answer, 1)?,
            bvh_bytes: number(&answer, 2)?,
            mesh_bytes: number(&answer, 3)?,
        })
    }

    /// Hands over rays; their index.
    pub(crate) fn add_rays(&mut self, rays: &[SinglePrecisionRay]) -> Result<usize, String> {
        let path = self.folder.path().join("rays");
        let numbers = |ray: &SinglePrecisionRay| [ray.origin.to_array(), ray.direction.to_array()];
        write_numbers(&path, rays.iter().flat_map(numbers).flatten().map(f32::to_ne_bytes))?;
        number(&self.ask(&format!("rays {} {}", path.display(), rays.len()), "rays")?, 0)
    }

    /// Traces some of the rays: the seconds it took.
    pub(crate) fn run(
        &mut self,
        mesh: &PeerMesh,
        rays: usize,
        mode: Mode,
        first: usize,
        count: usize,
    ) -> Result<f64, String> {
        let command = format!("run {} {rays} {mode} {first} {count}", mesh.index);
        number(&self.ask(&command, "run")?, 0)
    }

    /// The ray parameters of the nearest hits that [`Self::run`] found last, infinity for a miss.
    pub(crate) fn distances(&mut self, rays: usize) -> Result<Vec<f32>, String> {
        let path = self.folder.path().join("distances");
        self.ask(&format!("distances {rays} {}", path.display()), "distances")?;
        let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let (numbers, _) = bytes.as_chunks();
        Ok(numbers.iter().map(|&bytes| f32::from_ne_bytes(bytes)).collect())
    }

    fn ask(&mut self, command: &str, expected: &str) -> Result<Vec<String>, String> {
        writeln!(self.commands, "{command}").map_err(|error| format!("{command}: {error}"))?;
        self.answer(expected).map_err(|error| format!("{command}: {error}"))
    }

    /// The words of an answer, without the first, which is `expected`.
    fn answer(&mut self, expected: &str) -> Result<Vec<String>, String> {
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|error| error.to_string())?;
        let words = line.trim_end().strip_prefix(expected).ok_or_else(|| match line.trim_end() {
            "" => "the program that traces with Embree has ended".to_owned(),
            line => format!("answered \"{line}\""),
        })?;
        Ok(words.split_whitespace().map(str::to_owned).collect())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // either fails only if it has ended already
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn number<T: std::str::FromStr>(words: &[String], index: usize) -> Result<T, String> {
    let word = words.get(index).ok_or("an answer is too short")?;
    word.parse().map_err(|_| format!("\"{word}\" is not the number expected"))
}

fn write_numbers(path: &Path, numbers: impl Iterator<Item = [u8; 4]>) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    for bytes in numbers {
        file.write_all(&bytes).map_err(failed)?;
    }
    file.flush().map_err(failed)
}
