//! What a division of a frame into superpixels is worth: the one objective that every move must lower.
//!
//! In: pixels summed up in [`Moments`]. Out: energies. Forbidden here: the plane of pixels, deciding on moves.
//!
//! Energies are negative log-likelihoods up to constants, in units of squared colour distance (2 sigma^2 of a colour
//! channel), so that one means the same everywhere. Colours are whole numbers: sums are exact, whatever the order of
//! moves, and never need to be taken anew.

/// (L*, a*, b*) in steps of 1 / [`COLOR_STEPS`].
pub(super) type Color = [i16; 3];

/// Steps to a unit of L*, a* or b*: finer than 8-bit sRGB nearly everywhere.
pub(super) const COLOR_STEPS: f32 = 16.0;

/// Names are taken from no farther than this, in spacings of superpixels.
const REACH: f64 = 3.0;

/// Sums over a set of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Moments {
    /// Number of pixels.
    pub(super) area: i64,
    place: [i64; 2],
    place2: i64,
    color: [i64; 3],
    color2: i64,
}

impl Moments {
    pub(super) fn add(&mut self, place: [usize; 2], color: Color) {
        let (place, color) = (place.map(|v| v as i64), color.map(i64::from));
        self.area += 1;
        self.place = [0, 1].map(|i| self.place[i] + place[i]);
        self.place2 += place.iter().map(|v| v * v).sum::<i64>();
        self.color = [0, 1, 2].map(|i| self.color[i] + color[i]);
        self.color2 += color.iter().map(|v| v * v).sum::<i64>();
    }

    pub(super) fn remove(&mut self, place: [usize; 2], color: Color) {
        let mut pixel = Self::default();
        pixel.add(place, color);
        *self = self.minus(pixel);
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            place: [0, 1].map(|i| self.place[i] + other.place[i]),
            place2: self.place2 + other.place2,
            color: [0, 1, 2].map(|i| self.color[i] + other.color[i]),
            color2: self.color2 + other.color2,
        }
    }

    pub(super) fn minus(self, other: Self) -> Self {
        let negative = Self {
            area: -other.area,
            place: other.place.map(|v| -v),
            place2: -other.place2,
            color: other.color.map(|v| -v),
            color2: -other.color2,
        };
        self.plus(negative)
    }

    /// Mean x and y; the origin where there are no pixels.
    pub(super) fn centroid(&self) -> [f64; 2] {
        self.place.map(|sum| sum as f64 / self.area.max(1) as f64)
    }
}

/// What is known of a superpixel from the frame before: Gaussians about these means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    /// Where it is expected and which colour it had.
    pub(super) means: Means,
    /// How many pixels of this frame the knowledge is worth: the variance of a pixel over that of the mean's drift.
    pub(super) place_weight: f64,
    pub(super) color_weight: f64,
}

/// Means of a superpixel's Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Means {
    /// In pixel indices.
    pub(super) place: [f64; 2],
    /// L*, a*, b*.
    pub(super) color: [f64; 3],
}

/// The objective: the sum over superpixels of [`Model::energy`], [`Model::outline`] for every two of the eight
/// neighbours that belong to different ones, and [`Model::loyalty`] for every pixel that is not with the heir of the
/// superpixel that motion brought to it.
///
/// Chang, Wei and Fisher (CVPR 2013), §3: Gaussians with fixed variances whose means are at their most likely values
/// ("hard" parameters), a geometric distribution of the number, dearer for new superpixels than for old ones, a
/// Gaussian on the area. Outline and loyalty are ours: short and steady boundaries are what vertices are spent on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Model {
    /// Squared colour distance that a squared distance of one pixel weighs: the ratio of the two variances.
    pub(super) per_pixel2: f64,
    /// Area of a superpixel, were all alike, in pixels.
    pub(super) mean_area: f64,
    /// Price of a superpixel of twice or none of that area, a pixel of that area.
    pub(super) area_weight: f64,
    pub(super) outline: f64,
    pub(super) loyalty: f64,
    /// Price of a superpixel that was there before.
    pub(super) price: f64,
    /// How many times as dear a new one is.
    pub(super) novelty: f64,
}

impl Model {
    /// Energy of a superpixel of these pixels; new without a prior.
    pub(super) fn energy(&self, moments: &Moments, prior: Option<&Prior>) -> f64 {
        let price = if prior.is_some() { self.price } else { self.price * self.novelty };
        price + self.area_energy(moments.area) + self.misfit(moments, prior)
    }

    /// Whether a dead or another superpixel, of this prior, may give its name to one of these pixels.
    pub(super) fn is_near(&self, moments: &Moments, prior: &Prior) -> bool {
        let (a, b) = (moments.centroid(), prior.means.place);
        (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) < REACH * REACH * self.mean_area
    }

    fn area_energy(&self, area: i64) -> f64 {
        let excess = area as f64 - self.mean_area;
        self.area_weight * excess * excess / self.mean_area
    }

    /// Squared distances of the pixels to the means and of the means to the prior, at the best means.
    fn misfit(&self, moments: &Moments, prior: Option<&Prior>) -> f64 {
        let steps = f64::from(COLOR_STEPS);
        let colors = (moments.color.map(|sum| sum as f64 / steps), moments.color2 as f64 / (steps * steps));
        let places = (moments.place.map(|sum| sum as f64), moments.place2 as f64);
        let color_prior = prior.map(|prior| (prior.means.color, prior.color_weight));
        let place_prior = prior.map(|prior| (prior.means.place, prior.place_weight));
        scatter(moments.area, colors, color_prior) + self.per_pixel2 * scatter(moments.area, places, place_prior)
    }

    /// The most likely means.
    pub(super) fn means(&self, moments: &Moments, prior: Option<&Prior>) -> Means {
        let steps = f64::from(COLOR_STEPS);
        let color = moments.color.map(|sum| sum as f64 / steps);
        Means {
            place: mean(
                moments.area,
                moments.place.map(|sum| sum as f64),
                prior.map(|prior| (prior.means.place, prior.place_weight)),
            ),
            color: mean(moments.area, color, prior.map(|prior| (prior.means.color, prior.color_weight))),
        }
    }
}

fn mean<const D: usize>(area: i64, sums: [f64; D], prior: Option<([f64; D], f64)>) -> [f64; D] {
    let (known, weight) = prior.unwrap_or(([0.0; D], 0.0));
    let total = (area as f64 + weight).max(1e-9);
    std::array::from_fn(|d| (sums[d] + weight * known[d]) / total)
}

fn scatter<const D: usize>(area: i64, (sums, squares): ([f64; D], f64), prior: Option<([f64; D], f64)>) -> f64 {
    let (known, weight) = prior.unwrap_or(([0.0; D], 0.0));
    let total = (area as f64 + weight).max(1e-9);
    let explained: f64 = sums.iter().zip(known).map(|(sum, known)| (sum + weight * known).powi(2)).sum();
    squares + weight * known.iter().map(|v| v * v).sum::<f64>() - explained / total
}

#[cfg(test)]
mod tests {
    use super::{COLOR_STEPS, Means, Model, Moments, Prior};

    const MODEL: Model = Model {
        per_pixel2: 0.5,
        mean_area: 2.0,
        area_weight: 0.0,
        outline: 0.0,
        loyalty: 0.0,
        price: 10.0,
        novelty: 2.0,
    };

    fn moments(pixels: &[([usize; 2], i16)]) -> Moments {
        let mut moments = Moments::default();
        pixels.iter().for_each(|&(place, level)| moments.add(place, [level * COLOR_STEPS as i16, 0, 0]));
        moments
    }

    #[test]
    fn energy_is_the_scatter_about_the_most_likely_means() {
        let two = moments(&[([0, 0], 10), ([2, 0], 14)]);
        assert_eq!(MODEL.energy(&two, None), 20.0 + 2.0 * 4.0 + 0.5 * 2.0);
        // A prior worth two pixels: the colour's mean is between, at 16; 36 + 4 + 2 * 16.
        let means = Means { place: [1.0, 0.0], color: [20.0, 0.0, 0.0] };
        let prior = Prior { means, place_weight: 2.0, color_weight: 2.0 };
        assert_eq!(MODEL.means(&two, Some(&prior)).color, [16.0, 0.0, 0.0]);
        assert_eq!(MODEL.energy(&two, Some(&prior)), 10.0 + 36.0 + 4.0 + 2.0 * 16.0 + 0.5 * 2.0);
    }

    #[test]
    fn sums_add_up_exactly() {
        let (a, b) = (moments(&[([3, 4], 50), ([1, 9], 2)]), moments(&[([7, 7], 90)]));
        let mut both = a.plus(b);
        assert_eq!(both, moments(&[([7, 7], 90), ([1, 9], 2), ([3, 4], 50)]));
        both.remove([7, 7], [90 * COLOR_STEPS as i16, 0, 0]);
        assert_eq!(both, a);
    }
}
