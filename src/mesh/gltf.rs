//! glTF files, in text (`.gltf`) and binary (`.glb`).
//!
//! Read here and not by a crate: the `gltf` crate's readers panic where an accessor is longer than its buffer, and what is left
//! of it then are the types of [`gltf_json`](super::gltf_json).
//!
//! Source: Khronos Group (2021), *glTF 2.0 Specification*.

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3};

use super::file_error::{MeshFault, MeshFaultKind, MeshFaults, Place, ReadError};
use super::finish::Reading;
use super::gltf_data::{Buffers, Usage, Values, chunks, fault, find, side_file};
use super::gltf_fault::GltfFault;
use super::gltf_json::{Document, Material, Node, Primitive};
use super::material::MeshMaterial;
use super::polygon_mesh::{NONE, References};
use crate::memory::MemoryLimit;

/// Extensions that a file may need: they concern what is not used, or is read as without them.
const KNOWN: [&str; 2] = ["KHR_mesh_quantization", "KHR_texture_transform"];

/// Bytes that a vertex and a corner take.
const VERTEX_BYTES: u64 = 24 + 24 + 16 + 1;
const CORNER_BYTES: u64 = 3 * 4 + 4;

/// Bytes that a braced element of the document takes at most.
const ELEMENT_BYTES: u64 = 512;

/// Reads the bytes of a glTF file of this path: all meshes of its scene, placed by their nodes.
///
/// Materials are kept as far as [`MeshMaterial`] has them. Texture coordinates are turned to v upwards.
///
/// # Errors
/// The first fault.
pub(super) fn read_gltf(file: &[u8], path: &Path, memory: MemoryLimit) -> Result<Reading, ReadError> {
    read(file, path, memory).map_err(|fault| match fault.kind {
        MeshFaultKind::Gltf(GltfFault::Memory(error)) => ReadError::Memory(error),
        kind => {
            let mut faults = MeshFaults::default();
            faults.push(fault.place, kind);
            ReadError::Faults(faults)
        }
    })
}

fn read(file: &[u8], path: &Path, memory: MemoryLimit) -> Result<Reading, MeshFault> {
    let (text, binary) = if file.starts_with(b"glTF") { chunks(file)? } else { (file, None) };
    let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text);
    let counted = |mark: u8| text.iter().filter(|&&byte| byte == mark).count() as u64;
    let bytes = counted(b'{') * ELEMENT_BYTES + counted(b',') * 8;
    let asked = memory.ask(format_args!("mesh {}", path.display()), bytes);
    let _promise = asked.map_err(|error| fault("file".to_owned(), error.into()))?;
    let document: Document = serde_json::from_slice(text).map_err(|error| {
        let place = Place::Line([error.line().max(1), error.column().max(1)]);
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
        MeshFault { place, kind: GltfFault::Json(message.to_owned()).into() }
    })?;
    check(&document)?;
    let buffers = Buffers::read(&document, path, binary, memory)?;
    let mut builder = Builder {
        document: &document,
        buffers: &buffers,
        memory,
        what: path.display().to_string(),
        reading: Reading::default(),
        is_reached: vec![false; document.nodes.len()],
        uvs: Vec::new(),
        normals: Vec::new(),
        ignored: HashMap::new(),
    };
    builder.reading.columns.face_starts.push(0);
    builder.materials(path.parent().unwrap_or(Path::new("")));
    builder.scene()?;
    Ok(builder.finish())
}

/// Refuses other versions, and extensions without which the file cannot be read.
fn check(document: &Document) -> Result<(), MeshFault> {
    let asset = &document.asset;
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    if !version.starts_with("2.") || asset.min_version.as_ref().is_some_and(|least| least != "2.0") {
        return Err(fault("asset".to_owned(), GltfFault::Version(version.clone())));
    }
    let is_known = |name: &str| KNOWN.contains(&name) || name.starts_with("KHR_materials_");
    let needed = document.extensions_required.iter().find(|name| !is_known(name));
    needed.map_or(Ok(()), |name| {
        Err(fault("extensionsRequired".to_owned(), GltfFault::Extension { name: name.clone() }))
    })
}

struct Builder<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    memory: MemoryLimit,
    /// The file's path, for messages.
    what: String,
    reading: Reading,
    /// By node.
    is_reached: Vec<bool>,
    /// By corner, or [`NONE`].
    uvs: Vec<u32>,
    normals: Vec<u32>,
    ignored: HashMap<&'static str, usize>,
}

impl Builder<'_> {
    /// All nodes of the scene: of the one that the file shows first, or else of all roots.
    fn scene(&mut self) -> Result<(), MeshFault> {
        let document = self.document;
        let roots = match (document.scene, document.scenes.first()) {
            (Some(scene), _) => find(&document.scenes, "scene", scene, || "scene".to_owned())?.nodes.clone(),
            (None, Some(first)) => first.nodes.clone(),
            (None, None) => {
                let mut is_child = vec![false; document.nodes.len()];
                let children = document.nodes.iter().flat_map(|node| &node.children);
                children.for_each(|&child| {
                    if let Some(is_child) = is_child.get_mut(child) {
                        *is_child = true;
                    }
                });
                (0..document.nodes.len()).filter(|&node| !is_child[node]).collect()
            }
        };
        // a stack of its own: the nodes of a file may be nested as deep as it likes
        let mut left: Vec<_> = roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((index, parent)) = left.pop() {
            let here = || format!("nodes[{index}]");
            let node = find(&document.nodes, "node", index, || "scenes".to_owned())?;
            if std::mem::replace(&mut self.is_reached[index], true) {
                return Err(fault(here(), GltfFault::NotATree));
            }
            let placed = parent * local(node);
            if !placed.is_finite() {
                return Err(fault(here(), GltfFault::Transform));
            }
            left.extend(node.children.iter().rev().map(|&child| (child, placed)));
            if let Some(mesh) = node.mesh {
                self.mesh(node, mesh, placed, here)?;
            }
        }
        if !document.animations.is_empty() {
            self.ignore("animation", document.animations.len());
        }
        Ok(())
    }

    fn ignore(&mut self, what: &'static str, count: usize) {
        *self.ignored.entry(what).or_default() += count;
    }

    /// A node's mesh, as one object.
    fn mesh(
        &mut self,
        node: &Node,
        index: usize,
        placed: DAffine3,
        here: impl FnOnce() -> String,
    ) -> Result<(), MeshFault> {
        let mesh = find(&self.document.meshes, "mesh", index, here)?;
        if node.skin.is_some() {
            self.ignore("skin", 1);
        }
        let object = u32::try_from(self.reading.columns.object_names.len()).unwrap_or(NONE);
        let name = node.name.clone().or_else(|| mesh.name.clone()).unwrap_or_else(|| format!("mesh{index}"));
        self.reading.columns.object_names.push(name);
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let here = format!("meshes[{index}].primitives[{number}]");
            self.primitive(primitive, object, placed, &here)?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        object: u32,
        placed: DAffine3,
        here: &str,
    ) -> Result<(), MeshFault> {
        let mode = primitive.mode.unwrap_or(4);
        match mode {
            4..=6 => {}
            0..=3 => {
                self.ignore(if mode == 0 { "points" } else { "lines" }, 1);
                return Ok(());
            }
            _ => return Err(fault(here.to_owned(), GltfFault::Mode(mode))),
        }
        if let Some(name) = primitive.extensions.keys().find(|name| name.contains("draco")) {
            return Err(fault(here.to_owned(), GltfFault::Extension { name: name.clone() }));
        }
        if !primitive.targets.is_empty() {
            self.ignore("morph target", primitive.targets.len());
        }
        let document = self.document;
        let get = |index: Option<usize>, usage: Usage| -> Result<Option<Values<'_>>, MeshFault> {
            let Some(index) = index else { return Ok(None) };
            find(&document.accessors, "accessor", index, || here.to_owned())?;
            self.buffers.values(document, index, usage).map(Some)
        };
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        // what is drawn without positions is drawn by an extension
        let Some(positions) = get(attribute("POSITION"), Usage::Vectors)? else {
            self.ignore("primitive without positions", 1);
            return Ok(());
        };
        let set = self.texture_set(primitive, here)?;
        let uvs = get(attribute(&format!("TEXCOORD_{set}")), Usage::TextureCoordinates)?;
        let normals = get(attribute("NORMAL"), Usage::Vectors)?;
        let indices = get(primitive.indices, Usage::Indices)?;
        for (name, values) in [("TEXCOORD", uvs), ("NORMAL", normals)] {
            if let Some(values) = values.filter(|values| values.count != positions.count) {
                let found = format!("{} of {name} for {} of POSITION", values.count, positions.count);
                let expected = "attributes of a primitive are as many as its positions";
                return Err(fault(here.to_owned(), GltfFault::Kind { found, expected }));
            }
        }
        let corners = indices.map_or(positions.count, |indices| indices.count);
        if let Some(indices) = indices
            && let Some(index) = (0..indices.count)
                .map(|corner| indices.index(corner))
                .find(|&index| index as usize >= positions.count)
        {
            let (index, count) = (index as usize, positions.count);
            return Err(fault(here.to_owned(), GltfFault::OutOfRange { what: "vertex", index, count }));
        }
        let bytes = positions.count as u64 * VERTEX_BYTES + corners as u64 * 3 * CORNER_BYTES;
        let asked = self.memory.ask(format_args!("mesh {}", self.what), bytes);
        let _promise = asked.map_err(|error| fault(here.to_owned(), error.into()))?;
        let first = self.vertices([Some(positions), normals, uvs], placed);
        let material = match primitive.material {
            None => 0,
            Some(material) => {
                find(&document.materials, "material", material, || here.to_owned())?;
                u32::try_from(material + 1).unwrap_or(NONE)
            }
        };
        let run = Run {
            mode,
            corner: |corner: usize| {
                indices.map_or(u32::try_from(corner).unwrap_or(NONE), |values| values.index(corner))
            },
            count: corners,
            is_mirrored: placed.matrix3.determinant() < 0.0,
        };
        self.faces(&run, first, [normals.is_some(), uvs.is_some()]);
        let columns = &mut self.reading.columns;
        columns.face_objects.resize(columns.face_starts.len() - 1, object);
        columns.face_materials.resize(columns.face_starts.len() - 1, material);
        Ok(())
    }

    /// The set of texture coordinates that the material's picture has.
    fn texture_set(&self, primitive: &Primitive, here: &str) -> Result<u64, MeshFault> {
        let Some(material) = primitive.material else { return Ok(0) };
        let material = find(&self.document.materials, "material", material, || here.to_owned())?;
        let roughness = material.pbr_metallic_roughness.as_ref();
        let texture = roughness.and_then(|roughness| roughness.base_color_texture.as_ref());
        Ok(texture.map_or(0, |texture| texture.tex_coord))
    }

    /// Adds positions, normals and texture coordinates; the numbers of the first of each.
    fn vertices(
        &mut self,
        [positions, normals, uvs]: [Option<Values<'_>>; 3],
        placed: DAffine3,
    ) -> [usize; 3] {
        let columns = &mut self.reading.columns;
        let first = [columns.positions.len(), columns.normals.len(), columns.uvs.len()];
        let all = |values: Option<Values<'_>>| values.map_or(0, |values| values.count);
        if let Some(values) = positions {
            let place = |index: usize| placed.transform_point3(DVec3::from_array(values.reals(index)));
            columns.positions.extend((0..all(positions)).map(place));
        }
        if let Some(values) = normals {
            // normals are carried by the cofactors, which need no inverse
            let DMat3 { x_axis, y_axis, z_axis } = placed.matrix3;
            let [x, y, z] = [y_axis.cross(z_axis), z_axis.cross(x_axis), x_axis.cross(y_axis)];
            let side = if placed.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
            let carried = side * DMat3::from_cols(x, y, z);
            columns.normals.extend((0..all(normals)).map(|i| carried * DVec3::from_array(values.reals(i))));
        }
        if let Some(values) = uvs {
            let upwards = |[u, v]: [f64; 2]| DVec2::new(u, 1.0 - v);
            columns.uvs.extend((0..all(uvs)).map(|index| upwards(values.reals(index))));
        }
        first
    }

    fn faces(
        &mut self,
        run: &Run<impl Fn(usize) -> u32>,
        first: [usize; 3],
        [has_normals, has_uvs]: [bool; 2],
    ) {
        // what does not fit is refused with the mesh
        let from = |first: usize, index: u32| {
            u32::try_from(first).ok().and_then(|first| first.checked_add(index)).unwrap_or(NONE)
        };
        for triangle in run.triangles() {
            for corner in triangle {
                let index = (run.corner)(corner);
                let columns = &mut self.reading.columns;
                columns.corner_positions.push(from(first[0], index));
                self.normals.push(if has_normals { from(first[1], index) } else { NONE });
                self.uvs.push(if has_uvs { from(first[2], index) } else { NONE });
            }
            let columns = &mut self.reading.columns;
            // what does not fit is refused with the mesh
            columns.face_starts.push(u32::try_from(columns.corner_positions.len()).unwrap_or(NONE));
        }
    }

    fn materials(&mut self, folder: &Path) {
        let columns = &mut self.reading.columns;
        for (index, material) in self.document.materials.iter().enumerate() {
            let name = material.name.clone().unwrap_or_else(|| format!("material{index}"));
            // faces tell materials apart by names
            let is_taken = columns.material_names.contains(&name);
            let name = if is_taken { format!("{name}.{index}") } else { name };
            columns.materials.push(read_material(self.document, material, name.clone(), folder));
            columns.material_names.push(name);
        }
    }

    fn finish(mut self) -> Reading {
        let columns = &mut self.reading.columns;
        let own = |indices: Vec<u32>| match indices.iter().all(|&index| index == NONE) {
            true => References::Absent,
            false => References::Own(indices),
        };
        (columns.corner_normals, columns.corner_uvs) = (own(self.normals), own(self.uvs));
        if columns.material_names.is_empty() {
            columns.face_materials = Vec::new();
        }
        let ignored = self.ignored.into_iter().map(|(what, count)| (what.to_owned(), count));
        self.reading.notes.ignored_statements = ignored.collect();
        self.reading.notes.ignored_statements.sort();
        self.reading
    }
}

/// A run of corners that makes triangles.
struct Run<F> {
    /// 4, 5 or 6.
    mode: u64,
    /// The vertex of a corner.
    corner: F,
    count: usize,
    /// Whether the transform turns triangles round.
    is_mirrored: bool,
}

impl<F> Run<F> {
    fn triangles(&self) -> impl Iterator<Item = [usize; 3]> {
        let count = if self.mode == 4 { self.count / 3 } else { self.count.saturating_sub(2) };
        (0..count).map(|i| {
            let [a, b, c] = match self.mode {
                4 => [3 * i, 3 * i + 1, 3 * i + 2],
                // every other triangle of a strip winds the other way
                5 => [i, i + 1 + i % 2, i + 2 - i % 2],
                _ => [i + 1, i + 2, 0],
            };
            if self.is_mirrored { [a, c, b] } else { [a, b, c] }
        })
    }
}

/// What a node does to its children and its mesh.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    // as exact as the digits of the file; of length 0 it is no rotation
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from_array),
        rotation,
        node.translation.map_or(DVec3::ZERO, DVec3::from_array),
    )
}

/// A material as far as it is used.
fn read_material(document: &Document, material: &Material, name: String, folder: &Path) -> MeshMaterial {
    let mut left_out = Vec::new();
    let roughness = material.pbr_metallic_roughness.as_ref();
    let factor = roughness.and_then(|roughness| roughness.base_color_factor).unwrap_or([1.0; 4]);
    let unit =
        |number: Option<f64>| number.filter(|number| number.is_finite()).unwrap_or(1.0).clamp(0.0, 1.0);
    let base_color = DVec3::from_array([0, 1, 2].map(|channel| unit(Some(factor[channel]))));
    let texture = roughness.and_then(|roughness| roughness.base_color_texture.as_ref());
    let picture = texture.and_then(|texture| {
        let image = document.images.get(document.textures.get(texture.index)?.source?)?;
        side_file(folder, image.uri.as_deref()?)
    });
    let emission = material.emissive_factor.map_or(DVec3::ZERO, DVec3::from_array);
    // a picture of what it emits is black in most places
    let emits = material.emissive_texture.is_none() && emission.is_finite() && emission.min_element() >= 0.0;
    let odd = [
        (texture.is_some() && picture.is_none(), "picture of the base colour (not a file beside)"),
        (picture.is_some() && base_color != DVec3::ONE, "factor of its picture"),
        (texture.is_some_and(|texture| !texture.extensions.is_empty()), "transform of texture coordinates"),
        (
            roughness.is_some_and(|it| it.metallic_roughness_texture.is_some()),
            "picture of metal and roughness",
        ),
        (material.normal_texture.is_some(), "normal map"),
        (material.emissive_texture.is_some(), "picture of emission"),
        (material.alpha_mode.as_ref().is_some_and(|mode| mode != "OPAQUE"), "opacity"),
        (!material.extensions.is_empty(), "extensions"),
    ];
    left_out.extend(odd.into_iter().filter(|(is_odd, _)| *is_odd).map(|(_, what)| what));
    MeshMaterial {
        name,
        base_color,
        picture,
        metallic: unit(roughness.and_then(|roughness| roughness.metallic_factor)),
        roughness: unit(roughness.and_then(|roughness| roughness.roughness_factor)),
        emission: if emits { emission } else { DVec3::ZERO },
        left_out,
    }
}

#[cfg(test)]
mod tests;
