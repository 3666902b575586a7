// The encoder of a batch of blocks, compiled for each SIMD level and chosen at run time.
#include "bake/texture/etc1/etc1_kernel.hpp"

// Machines without SSE4 take the plain integers: one level less to compile.
#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/texture/etc1/etc1_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

#include <hwy/highway.h>

#include "bake/texture/etc1/etc1_thorough-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

template <class W>
void encode_group(const Pixels& pixels, const Etc1Search& search, Row& high, Row& low) {
  PixelPairs pairs;
  pair_up(pixels, pairs);
  Choice choice;
  store(set(0x7fffffff), choice.error);
  for (const bool flip : {false, true}) {
    HalfStats stats[2];
    gather_stats<W>(pixels, flip, 0, stats[0]);
    gather_stats<W>(pixels, flip, 1, stats[1]);
    HalfSite site[2] = {{pairs, stats[0], flip, 0, {}, {}}, {pairs, stats[1], flip, 1, {}, {}}};
    if (search.thorough) {
      thorough_differential<W>(search, 0, site, choice);
      thorough_differential<W>(search, 1, site, choice);
      thorough_individual<W>(search, site, choice);
    } else {
      quick_mode<5, W>(search, site, choice);
      quick_mode<4, W>(search, site, choice);
    }
    try_extremes<W>(search, site, choice);
  }
  if (!search.exact) settle_tables<W>(pairs, choice);
  store(high_word(choice), high);
  store(low_word<W>(pairs, choice), low);
}

template <class W>
void encode_all(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  const Lanes d;
  const hn::RebindToUnsigned<Lanes> u;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t first = 0; first < kEtc1Batch; first += lanes) {
    Pixels pixels;
    for (std::size_t i = 0; i < 16; ++i) {
      const V rgba = hn::BitCast(d, hn::LoadU(u, in.pixels[i] + first));
      store(red_of(rgba), pixels.red[i]);
      store(green_of(rgba), pixels.green[i]);
      store(blue_of(rgba), pixels.blue[i]);
    }
    Row high;
    Row low;
    encode_group<W>(pixels, search, high, low);
    hn::StoreU(hn::BitCast(u, load(high)), u, out.high + first);
    hn::StoreU(hn::BitCast(u, load(low)), u, out.low + first);
  }
}

void encode_batch(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  if (search.perceptual) {
    encode_all<LumaWeights>(in, search, out);
  } else {
    encode_all<EqualWeights>(in, search, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace modar {

HWY_EXPORT(encode_batch);

void encode_etc1_batch(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  HWY_DYNAMIC_DISPATCH(encode_batch)(in, search, out);
}

std::vector<std::int64_t> etc1_simd_levels() {
  return hwy::SupportedAndGeneratedTargets();
}

std::string etc1_simd_name(std::int64_t level) {
  return hwy::TargetName(level);
}

void force_etc1_simd_level(std::int64_t level) {
  hwy::SetSupportedTargetsForTest(level);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace modar
#endif  // HWY_ONCE
