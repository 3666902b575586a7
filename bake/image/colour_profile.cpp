// Colours that a picture's file states, to sRGB through lcms2.
#include <cmath>
#include <memory>

#include <lcms2.h>

#include "bake/image/decoders.hpp"

namespace modar {
namespace {

/// Steps of 255 up to which nothing is converted: profiles of sRGB differ by rounding.
constexpr int kSame = 2;
/// gAMA of sRGB is 0.45455. Of values this near, sRGB's own curve is meant.
constexpr double kGammaSlack = 0.005;

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<void, CloseProfile>;

struct FreeCurve {
  void operator()(cmsToneCurve* curve) const { cmsFreeToneCurve(curve); }
};

/// Of a PNG's gAMA and cHRM; each is sRGB's where it is not stated.
Profile matrix_profile(const StatedColours& stated) {
  constexpr double kGammaOfSrgb = 0.45455;
  const bool usual = stated.gamma == 0 || std::fabs(stated.gamma - kGammaOfSrgb) < kGammaSlack;
  const double curve_of_srgb[] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  const std::unique_ptr<cmsToneCurve, FreeCurve> curve(
      usual ? cmsBuildParametricToneCurve(nullptr, 4, curve_of_srgb)
            : cmsBuildGamma(nullptr, 1 / stated.gamma));
  cmsToneCurve* const curves[] = {curve.get(), curve.get(), curve.get()};
  const auto& [wx, wy, rx, ry, gx, gy, bx, by] = stated.primaries;
  const cmsCIExyY white = {wx, wy, 1};
  const cmsCIExyYTRIPLE primaries = {{rx, ry, 1}, {gx, gy, 1}, {bx, by, 1}};
  return curve ? Profile(cmsCreateRGBProfile(&white, &primaries, curves)) : nullptr;
}

using Transform = std::unique_ptr<void, decltype(&cmsDeleteTransform)>;

Transform to_srgb(const Profile& from, cmsUInt32Number format,
                  cmsUInt32Number flags = cmsFLAGS_COPY_ALPHA) {
  const Profile srgb(cmsCreate_sRGBProfile());
  return {cmsCreateTransform(from.get(), format, srgb.get(), TYPE_RGBA_8,
                             INTENT_RELATIVE_COLORIMETRIC, flags),
          &cmsDeleteTransform};
}

Profile open_profile(std::span<const std::byte> bytes) {
  return Profile(cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
}

bool is_gray(const RgbaImage& image) {
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const std::uint8_t* p = &image.pixels[i];
    if (p[0] != p[1] || p[0] != p[2]) return false;
  }
  return true;
}

bool differs(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::abs(int{a[i]} - int{b[i]}) > kSame) return true;
  }
  return false;
}

bool convert_gray(const Profile& profile, RgbaImage& image) {
  const Transform transform = to_srgb(profile, TYPE_GRAY_8);
  if (!transform || !is_gray(image)) return false;
  std::array<std::uint8_t, 256> gray{};
  std::array<std::uint8_t, 1024> seen{};
  for (std::size_t i = 0; i < gray.size(); ++i) gray[i] = static_cast<std::uint8_t>(i);
  cmsDoTransform(transform.get(), gray.data(), seen.data(), 256);
  std::array<std::uint8_t, 256> mapped{};
  for (std::size_t i = 0; i < mapped.size(); ++i) mapped[i] = seen[4 * i + 1];
  if (!differs(gray, mapped)) return false;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::fill_n(&image.pixels[i], 3, mapped[image.pixels[i]]);
  }
  return true;
}

bool convert_colours(const Profile& profile, RgbaImage& image) {
  const Transform transform = to_srgb(profile, TYPE_RGBA_8);
  if (!transform) return false;
  constexpr int kSteps = 6;  // of 51
  std::vector<std::uint8_t> grid;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    for (const int step : {i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps, kSteps - 1}) {
      grid.push_back(static_cast<std::uint8_t>(51 * step));
    }
  }
  std::vector<std::uint8_t> seen = grid;
  cmsDoTransform(transform.get(), grid.data(), seen.data(),
                 static_cast<cmsUInt32Number>(grid.size() / 4));
  if (!differs(grid, seen)) return false;
  for (std::size_t y = 0; y < image.height; ++y) {
    std::uint8_t* const row = &image.pixels[y * image.width * 4];
    cmsDoTransform(transform.get(), row, row, image.width);
  }
  return true;
}

/// As if each ink took its own light alone.
void mix_inks(bool inverted, RgbaImage& image) {
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::uint8_t* const pixel = &image.pixels[i];
    const int paper = inverted ? pixel[3] : 255 - pixel[3];
    for (std::size_t c = 0; c < 3; ++c) {
      const int ink = inverted ? 255 - pixel[c] : pixel[c];
      pixel[c] = static_cast<std::uint8_t>(paper - (ink * paper >> 8));
    }
    pixel[3] = 255;
  }
}

}  // namespace

bool convert_to_srgb(const StatedColours& stated, RgbaImage& image) {
  Profile profile;
  if (!stated.profile.empty()) {
    profile = open_profile(stated.profile);
  } else if (stated.gamma > 0 || stated.has_primaries) {
    profile = matrix_profile(stated);
  }
  if (!profile) return false;
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  if (space == cmsSigGrayData) return convert_gray(profile, image);
  return space == cmsSigRgbData && convert_colours(profile, image);
}

void convert_inks(std::span<const std::byte> profile, bool inverted, RgbaImage& image) {
  const Profile inks = open_profile(profile);
  if (!inks || cmsGetColorSpace(inks.get()) != cmsSigCmykData) return mix_inks(inverted, image);
  const Transform transform = to_srgb(inks, inverted ? TYPE_CMYK_8_REV : TYPE_CMYK_8, 0);
  if (!transform) return mix_inks(inverted, image);
  for (std::size_t y = 0; y < image.height; ++y) {
    std::uint8_t* const row = &image.pixels[y * image.width * 4];
    cmsDoTransform(transform.get(), row, row, image.width);
    for (std::size_t x = 0; x < image.width; ++x) row[4 * x + 3] = 255;
  }
}

}  // namespace modar
