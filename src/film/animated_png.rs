//! PNG files that show several pictures in turn; the only file that names the `png` crate.

use super::picture::EncodeError;
use super::raster::Raster;

/// The bytes of a PNG file that shows rasters of one size in turn, for ever; programs that know no such files show the first.
///
/// # Errors
/// If there are no rasters, or if their sizes differ.
pub fn encode_animation(frames: &[&Raster], milliseconds: u16) -> Result<Vec<u8>, EncodeError> {
    let first = frames.first().ok_or(EncodeError::NoPictures)?;
    if frames.iter().any(|frame| frame.size != first.size) {
        return Err(EncodeError::Sizes);
    }
    encode(frames, first.size, milliseconds).map_err(|error| EncodeError::Encoder(error.to_string()))
}

fn encode(
    frames: &[&Raster],
    [width, height]: [u32; 2],
    milliseconds: u16,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.set_animated(u32::try_from(frames.len()).unwrap_or(u32::MAX), 0)?;
    encoder.set_frame_delay(milliseconds, 1000)?;
    let mut writer = encoder.write_header()?;
    for frame in frames {
        writer.write_image_data(frame.pixels.as_flattened())?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back() {
        let raster = |value: u8| Raster { size: [3, 2], pixels: vec![[value; 3]; 6] };
        let frames = [raster(10), raster(200)];
        let bytes = encode_animation(&[&frames[0], &frames[1]], 500).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (2, 0));
        let mut pixels = vec![0; 18];
        for frame in &frames {
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, frame.pixels.as_flattened());
            let shown = reader.info().frame_control().unwrap();
            assert_eq!((shown.delay_num, shown.delay_den), (500, 1000));
        }
        assert!(encode_animation(&[], 500).is_err());
        let other = Raster { size: [1, 1], pixels: vec![[0; 3]] };
        assert!(encode_animation(&[&frames[0], &other], 500).unwrap_err() == EncodeError::Sizes);
    }
}
