//! Shares of a picture, put together.

use glam::{DVec2, DVec3};

use super::*;
use crate::film::{Film, FilmSettings, Image};
use crate::shade::Sampler;

const SPP: u32 = 427; // six full blocks and a part of one

fn film(filter: Filter) -> Film {
    let settings = FilmSettings { size: [21, 18], filter, crop: None };
    Film::try_new(&settings, &[Aov::Depth, Aov::Variance]).unwrap()
}

/// The samples of a pixel: bright ones and dark ones, so that sums depend on their order; few of them hit.
fn samples(pixel: [u32; 2], indices: Range<u32>) -> (Vec<DVec2>, Vec<Sample>) {
    let sample = |index| {
        let mut numbers = Sampler::new(8, pixel, index);
        let offset = numbers.next_2d();
        let value = libm::exp(9.0 * numbers.next_1d());
        let first_hit = (numbers.next_1d() < 0.01).then_some(FirstHit {
            depth: value,
            position: DVec3::ZERO,
            normal: DVec3::Z,
            geo_normal: DVec3::Z,
            uv: DVec2::ZERO,
            st: DVec2::ZERO,
            rest: DVec3::ZERO,
            ids: None,
            albedo: DVec3::ZERO,
        });
        let radiance = DVec3::new(value, 0.1, -value / 3.0);
        (offset, Sample { radiance, alpha: numbers.next_1d(), first_hit })
    };
    indices.map(sample).unzip()
}

/// Takes samples of a tile in passes of 16, as far as they are within a block.
fn expose(exposure: &mut Exposure, indices: Range<u32>) {
    for start in indices.clone().step_by(16) {
        let pass = start..indices.end.min(start + 16);
        for pixel in exposure.tile().places() {
            let (offsets, samples) = samples(pixel, pass.clone());
            assert_eq!(exposure.add(pixel, start, &offsets, &samples), 0);
        }
        exposure.end_pass(pass);
    }
}

/// A number below `end`.
fn below(end: u32, numbers: &mut Sampler) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the whole part is meant")]
    let whole = (numbers.next_1d() * f64::from(end)) as u32;
    whole
}

fn shuffle<T>(items: &mut [T], numbers: &mut Sampler) {
    for end in (2..=items.len()).rev() {
        let other = below(u32::try_from(end).unwrap(), numbers) as usize;
        items.swap(end - 1, other);
    }
}

/// The bits of all channels.
fn bits(image: &Image) -> Vec<u32> {
    image.channels().iter().flat_map(|channel| &channel.values).map(|value| value.to_bits()).collect()
}

#[test]
fn any_split_gives_the_same_bits() {
    for filter in [Filter::Box, Filter::Mitchell] {
        let film = film(filter);
        let mut whole: Vec<_> = film.tiles().into_iter().map(|tile| film.exposure(tile)).collect();
        whole.iter_mut().for_each(|exposure| expose(exposure, 0..SPP));
        assert!(whole.iter().all(|exposure| exposure.samples() == SPP && exposure.starts_at_zero()));
        let want = film.develop(&whole);
        for round in 0..6 {
            let numbers = &mut Sampler::new(round, [1, 2], 0);
            // each block of each tile is of one of a few parts, which take theirs in an order of their own
            let count = 1 + below(5, numbers);
            let mut parts: Vec<Vec<_>> = vec![Vec::new(); count as usize];
            for tile in 0..whole.len() {
                for block in 0..SPP.div_ceil(BLOCK) {
                    parts[below(count, numbers) as usize].push((tile, block));
                }
            }
            let mut stored = Vec::new();
            for part in &mut parts {
                shuffle(part, numbers);
                let mut exposures: Vec<_> =
                    film.tiles().into_iter().map(|tile| film.exposure(tile)).collect();
                for &(tile, block) in &*part {
                    expose(&mut exposures[tile], block * BLOCK..SPP.min((block + 1) * BLOCK));
                }
                let mut bytes = Vec::new();
                exposures.iter().for_each(|exposure| exposure.save(&mut bytes));
                stored.push(bytes);
            }
            shuffle(&mut stored, numbers);
            let mut merged: Vec<_> = film.tiles().into_iter().map(|tile| film.exposure(tile)).collect();
            for bytes in &stored {
                let mut bytes = &bytes[..];
                for exposure in &mut merged {
                    let mut part = film.exposure(exposure.tile());
                    part.load(&mut bytes).unwrap();
                    exposure.merge(part).unwrap();
                }
                assert!(bytes.is_empty());
            }
            assert!(merged == whole, "{filter:?}, {round}: sums differ in memory");
            assert_eq!(bits(&film.develop(&merged)), bits(&want), "{filter:?}, {round}");
        }
    }
}

#[test]
fn passes_go_on_where_they_were_interrupted() {
    let film = film(Filter::Gaussian);
    let tile = film.tiles()[0];
    let mut whole = film.exposure(tile);
    expose(&mut whole, 0..SPP);
    for round in 0..4 {
        let numbers = &mut Sampler::new(round, [3, 4], 0);
        let mut exposure = film.exposure(tile);
        let mut done = 0;
        while done < SPP {
            let end = SPP.min(done + 16 * (1 + below(9, numbers)));
            expose(&mut exposure, done..end);
            done = end;
            let mut bytes = Vec::new();
            exposure.save(&mut bytes);
            exposure = film.exposure(tile);
            exposure.load(&mut &bytes[..]).unwrap();
            assert!(exposure.samples() == done && exposure.starts_at_zero());
        }
        assert!(exposure == whole, "{round}");
    }
}

#[test]
fn blocks_keep_the_digits_of_the_variance() {
    // values about 1e6 with a deviation of 1: the samples' own formula, with all values at hand
    let film =
        Film::try_new(&FilmSettings { size: [1, 1], ..FilmSettings::default() }, &[Aov::Variance]).unwrap();
    let mut exposure = film.exposure(film.tiles()[0]);
    let values: Vec<f64> =
        (0..1000).map(|index| 1e6 + 3.46 * (Sampler::new(1, [0, 0], index).next_1d() - 0.5)).collect();
    for (block, values) in values.chunks(BLOCK as usize).enumerate() {
        let start = u32::try_from(block).unwrap() * BLOCK;
        let sample = |&value| Sample { radiance: DVec3::splat(value), alpha: 1.0, first_hit: None };
        let samples: Vec<_> = values.iter().map(sample).collect();
        exposure.add([0, 0], start, &vec![DVec2::splat(0.5); samples.len()], &samples);
        exposure.end_pass(start..start + u32::try_from(values.len()).unwrap());
    }
    let mean = values.iter().map(|value| value - 1e6).sum::<f64>() / 1000.0;
    let squares: f64 = values.iter().map(|value| (value - 1e6 - mean).powi(2)).sum();
    let image = film.develop([&exposure]);
    let [red, variance] = ["R", "variance.R"].map(|name| f64::from(image.channel(name).unwrap()[0]));
    assert!((red - 1e6 - mean).abs() < 0.05, "{red}");
    assert!((variance / (squares / (1000.0 * 999.0)) - 1.0).abs() < 1e-6, "{variance}");
    assert_eq!(image.channel("A").unwrap(), [1.0]);
}

#[test]
fn shares_that_do_not_fit_are_refused() {
    let film = film(Filter::Tent);
    let tiles = film.tiles();
    let exposed = |film: &Film, tile, indices| {
        let mut exposure = film.exposure(tile);
        expose(&mut exposure, indices);
        exposure
    };
    let mut sum = exposed(&film, tiles[0], 0..128);
    let before = sum.clone();
    assert_eq!(sum.merge(exposed(&film, tiles[0], 64..70)), Err(MergeError::Overlap));
    assert_eq!(sum.merge(exposed(&film, tiles[1], 128..192)), Err(MergeError::OtherTile));
    let other = self::film(Filter::Gaussian);
    assert_eq!(sum.merge(exposed(&other, tiles[0], 128..192)), Err(MergeError::OtherTile));
    assert!(sum == before);
    sum.merge(exposed(&film, tiles[0], 192..200)).unwrap();
    assert!(!sum.starts_at_zero() && sum.samples() == 136, "a block is missing");

    let mut bytes = Vec::new();
    sum.save(&mut bytes);
    let load = |bytes: &[u8]| film.exposure(tiles[0]).load(&mut &bytes[..]);
    assert!(load(&bytes).is_some());
    for length in [0, 3, 9, bytes.len() / 2, bytes.len() - 1] {
        assert!(load(&bytes[..length]).is_none(), "{length} bytes");
    }
    // two runs of blocks 0 and 1, and of block 3: neither may begin elsewhere or be longer
    for (place, number) in [(4, 1_u32), (8, 3), (8, u32::MAX), (12, 127), (12, 129)] {
        let mut bytes = bytes.clone();
        bytes[place..place + 4].copy_from_slice(&number.to_le_bytes());
        assert!(load(&bytes).is_none(), "{number} at {place}");
    }
}
