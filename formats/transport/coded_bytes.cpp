#include "formats/transport/coded_bytes.hpp"

#include <algorithm>
#include <utility>

#include "formats/transport/context_coder.hpp"

namespace modar {
namespace {

/// Weights are chosen by a byte's place in its record and bit, and by the bits before.
std::size_t sets_of(std::uint32_t stride) {
  return std::size_t{stride} * 8 + 256;
}

/// Codes the byte at `at`, of which all before are known.
std::byte code_byte(ContextCoder& coder, std::span<const std::byte> bytes, std::size_t at,
                    std::uint32_t stride) {
  const auto back = [&](std::size_t n) {
    return at >= n ? std::to_integer<std::uint32_t>(bytes[at - n]) : 0u;
  };
  const auto place = static_cast<std::uint32_t>(at % stride);
  const std::uint32_t last = back(1);
  const std::uint32_t above = back(stride);
  const std::uint32_t above2 = back(std::size_t{2} * stride);
  const std::uint32_t two = back(2) << 8 | last;
  const std::uint32_t here = place << 16;
  const auto set = [&](std::uint32_t kind, std::uint32_t hash) {
    coder.set_context(kind, (kind + 1) << 28 ^ hash);
  };
  set(0, place);
  set(1, place << 8 | last);
  set(2, two);
  set(3, place << 8 | above);
  set(4, here | above << 8 | above2);
  set(5, here | above << 8 | last);
  set(6, back(3) * 0x9E3779u ^ two * 0x101u);
  set(7, place << 8 | ((2 * above - above2) & 0xFF));
  set(8, back(4) * 0xC2B2AEu ^ back(3) * 0x9E3779u ^ two * 0x101u);
  const auto byte = std::to_integer<std::uint32_t>(bytes[at]);
  std::uint32_t node = 1;
  for (std::uint32_t bit = 8; bit-- > 0;) {
    const bool one = coder.code((byte >> bit & 1) != 0, node * 0x3D4D51CBu, place * 8 + bit,
                                std::size_t{stride} * 8 + node);
    node = node * 2 + (one ? 1 : 0);
  }
  return static_cast<std::byte>(node & 0xFF);
}

constexpr std::size_t kPredictors = 7;
constexpr std::size_t kTaps = 10;
constexpr std::size_t kEnergies = 11;
/// Decisions that have weights of their own: zero, sign, then magnitudes.
constexpr std::uint32_t kNodes = 18;
constexpr std::size_t kPictureSets = kEnergies + kNodes;
/// Magnitudes from here on share contexts.
constexpr int kMostMagnitude = 31;

/// A difference of grays in 15 steps.
std::uint32_t step_of(int difference) {
  constexpr int kEnds[] = {1, 3, 6, 11, 20, 40, 80};
  const int size = difference < 0 ? -difference : difference;
  int step = 0;
  for (const int end : kEnds) step += size >= end ? 1 : 0;
  return static_cast<std::uint32_t>(difference < 0 ? 15 - step : step);
}

std::size_t energy_step(int energy) {
  constexpr int kEnds[] = {3, 7, 12, 20, 32, 48, 72, 110, 180, 300};
  std::size_t step = 0;
  for (const int end : kEnds) step += energy >= end ? 1u : 0u;
  return step;
}

int magnitude(int value) {
  return value < 0 ? -value : value;
}

/// Codes the pixels of a picture, a row at a time: each as its difference from a prediction, which
/// blends several by how they did nearby, and corrects what such places had on average.
class PictureModel {
 public:
  PictureModel(ContextCoder& coder, std::uint32_t width)
      : coder_(coder),
        width_(width),
        errors_(width + 2),
        errors_above_(width + 2),
        misses_(width + 2),
        misses_above_(width + 2) {
    for (auto& row : rows_) row.assign(width + 2 * kBorder, 128);
    taps_[0] = taps_[1] = kOne / 2;
  }

  void code_row(std::span<std::uint8_t> row) {
    std::rotate(rows_.begin(), rows_.begin() + 2, rows_.end());
    std::fill_n(rows_[0].begin(), kBorder, rows_[1][kBorder]);
    for (x_ = 0; x_ < width_; ++x_) {
      look();
      predict();
      set_contexts();
      const int value = code(row[x_]);
      row[x_] = static_cast<std::uint8_t>(value);
      rows_[0][x_ + kBorder] = row[x_];
      learn(value);
    }
    std::fill_n(rows_[0].end() - kBorder, kBorder, row.back());
    std::swap(errors_, errors_above_);
    std::swap(misses_, misses_above_);
  }

 private:
  static constexpr std::size_t kBorder = 3;
  static constexpr std::int64_t kOne = 65536;

  [[nodiscard]] int at(std::size_t up, int right) const {
    return rows_[up][static_cast<std::size_t>(static_cast<std::ptrdiff_t>(x_ + kBorder) + right)];
  }

  void look() {
    w_ = at(0, -1);
    n_ = at(1, 0);
    nw_ = at(1, -1);
    ne_ = at(1, 1);
    ww_ = at(0, -2);
    nn_ = at(2, 0);
    around_ = {w_, n_, nw_, ne_, ww_, nn_, at(2, 1), at(1, 2), at(1, -2), at(2, -1)};
    // misses_[x_ + 1] is this pixel's.
    miss_w_ = misses_[x_];
    miss_n_ = misses_above_[x_ + 1];
    const int energy = 2 * magnitude(miss_w_) + 2 * magnitude(miss_n_) +
                       magnitude(misses_above_[x_ + 2]) + magnitude(misses_above_[x_]) +
                       magnitude(w_ - nw_) + magnitude(n_ - nw_) + magnitude(n_ - ne_);
    energy_ = energy_step(energy);
  }

  void predict() {
    const int least = std::min(w_, n_);
    const int most = std::max(w_, n_);
    const int median = nw_ >= most ? least : nw_ <= least ? most : w_ + n_ - nw_;
    mean_ = (w_ + n_ + ne_ + nw_ + 2) / 4;
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < kTaps; ++i) sum += (around_[i] - mean_) * taps_[i];
    const int learnt = mean_ + static_cast<int>((sum + kOne / 2) >> 16);
    guesses_ = {
        w_, n_, w_ + ne_ - n_, n_ + w_ - nw_, median, (2 * (w_ + n_) + ne_ - nw_ + 2) / 4, learnt};
    std::int64_t weights = 0;
    std::int64_t blend = 0;
    best_ = 1 << 30;
    for (std::size_t k = 0; k < kPredictors; ++k) {
      const int error = 2 * errors_[x_][k] + 2 * errors_above_[x_ + 1][k] +
                        errors_above_[x_ + 2][k] + errors_above_[x_][k] + 1;
      best_ = std::min(best_, error);
      const std::int64_t weight = (1 << 24) / (std::int64_t{error} * error + 1) + 1;
      weights += weight;
      blend += weight * std::clamp(guesses_[k], 0, 255);
    }
    blended_ = static_cast<int>(blend * 8 / weights);
    const int near = (blended_ + 4) >> 3;
    std::size_t place = energy_;
    for (std::size_t i = 0; i < 6; ++i) {
      place += around_[i] > near ? std::size_t{16} << i : 0;
    }
    bias_ = &biases_[place];
    const int fine = blended_ + (bias_->count == 0 ? 0 : bias_->sum / bias_->count);
    prediction_ = std::clamp((fine + 4) >> 3, 0, 255);
    fraction_ = static_cast<std::uint32_t>(fine & 7);
  }

  void set_contexts() {
    const auto energy = static_cast<std::uint32_t>(energy_);
    const auto near = static_cast<std::uint32_t>(best_ > 40 ? 7 : best_ / 6);
    const auto prediction = static_cast<std::uint32_t>(prediction_);
    const std::uint32_t miss_w = step_of(miss_w_);
    const std::uint32_t from_w = step_of(w_ - prediction_);
    const auto set = [&](std::uint32_t kind, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                         std::uint32_t d = 0) {
      coder_.set_context(kind, (kind + 1) << 28 ^ a << 24 ^ b << 16 ^ c << 8 ^ d);
    };
    set(0, 0, energy, near);
    set(1, miss_w, step_of(miss_n_), step_of(misses_above_[x_ + 2]));
    set(2, from_w, step_of(n_ - prediction_), energy);
    set(3, step_of(ne_ - prediction_), step_of(nw_ - prediction_), from_w);
    set(4, 0, prediction >> 2, energy);
    set(5, 0, static_cast<std::uint32_t>(w_), static_cast<std::uint32_t>(n_), prediction);
    set(6, fraction_, step_of(ww_ - w_), step_of(nn_ - n_), energy);
    set(7, step_of(w_ - nw_), step_of(n_ - ne_), step_of(n_ - nw_), miss_w);
    set(8, step_of(guesses_[4] - prediction_), step_of(guesses_[6] - prediction_), energy);
  }

  bool decide(bool holds, std::uint32_t node, std::uint32_t set) {
    return coder_.code(holds, node, energy_, kEnergies + set);
  }

  /// Zero, the sign, then the magnitude by its unary number: short where predictions are good.
  int code(int value) {
    const int difference = value - prediction_;
    if (decide(difference == 0, 0, 0)) return prediction_;
    const bool below = prediction_ == 255 || (prediction_ != 0 && decide(difference < 0, 1, 1));
    const int most = (below ? prediction_ : 255 - prediction_) - 1;
    const int wanted = magnitude(difference) - 1;
    int size = 0;
    for (; size < most; ++size) {
      const int known = std::min(size, kMostMagnitude);
      const auto node = static_cast<std::uint32_t>(known + (below ? 2 : 34));
      const auto set = static_cast<std::uint32_t>(std::min(known, 7) + (below ? 2 : 10));
      if (!decide(wanted > size, node, set)) break;
    }
    return below ? prediction_ - size - 1 : prediction_ + size + 1;
  }

  void learn(int value) {
    bias_->sum += value * 8 - blended_;
    if (++bias_->count >= 64) {
      bias_->sum /= 2;
      bias_->count /= 2;
    }
    // Normalised least mean squares: a step of 3 %, less where the picture is flat.
    constexpr std::int64_t kStep = 2000;
    std::int64_t power = 60;
    for (const int gray : around_) power += std::int64_t{gray - mean_} * (gray - mean_);
    const std::int64_t error = value - std::clamp(guesses_[6], 0, 255);
    for (std::size_t i = 0; i < kTaps; ++i) {
      taps_[i] += error * (around_[i] - mean_) * kStep / power;
    }
    for (std::size_t k = 0; k < kPredictors; ++k) {
      errors_[x_ + 1][k] = magnitude(value - guesses_[k]);
    }
    misses_[x_ + 1] = value - prediction_;
  }

  struct Bias {
    int sum = 0;  ///< eighths of a gray
    int count = 0;
  };

  ContextCoder& coder_;
  std::size_t width_;
  std::size_t x_ = 0;
  std::array<std::vector<std::uint8_t>, 3> rows_;     ///< this one and two above, with a border
  std::vector<std::array<int, kPredictors>> errors_;  ///< of the row's guesses, from pixel -1 on
  std::vector<std::array<int, kPredictors>> errors_above_;
  std::vector<int> misses_;  ///< of the predictions
  std::vector<int> misses_above_;
  std::array<Bias, 1024> biases_{};
  std::array<std::int64_t, kTaps> taps_{};
  std::array<int, kTaps> around_{};
  std::array<int, kPredictors> guesses_{};
  Bias* bias_ = nullptr;
  // Of the pixel at x_: greys around it by the compass, and values made of them.
  int w_ = 0, n_ = 0, nw_ = 0, ne_ = 0, ww_ = 0, nn_ = 0;
  int miss_w_ = 0, miss_n_ = 0;
  int mean_ = 0;
  int best_ = 0;
  int blended_ = 0;  ///< eighths
  int prediction_ = 0;
  std::uint32_t fraction_ = 0;
  std::size_t energy_ = 0;
};

}  // namespace

std::vector<std::byte> encode_bytes(std::span<const std::byte> raw, std::uint32_t stride) {
  ContextCoder coder(sets_of(stride));
  for (std::size_t i = 0; i < raw.size(); ++i) code_byte(coder, raw, i, stride);
  return coder.finish();
}

std::optional<std::vector<std::byte>> decode_bytes(std::span<const std::byte> coded,
                                                   std::size_t raw_size, std::uint32_t stride) {
  ContextCoder coder(sets_of(stride), coded);
  std::vector<std::byte> raw(raw_size);
  for (std::size_t i = 0; i < raw_size; ++i) {
    raw[i] = code_byte(coder, raw, i, stride);
    if (coder.overrun()) return std::nullopt;
  }
  return raw;
}

std::vector<std::byte> encode_picture(std::span<const std::uint8_t> pixels, std::uint32_t width) {
  ContextCoder coder(kPictureSets);
  PictureModel model(coder, width);
  std::vector<std::uint8_t> row(width);
  for (std::size_t first = 0; first < pixels.size(); first += width) {
    std::copy_n(pixels.begin() + static_cast<std::ptrdiff_t>(first), width, row.begin());
    model.code_row(row);
  }
  return coder.finish();
}

struct PictureDecoder::State {
  State(std::span<const std::byte> coded, std::uint32_t width)
      : coder(kPictureSets, coded), model(coder, width) {}
  ContextCoder coder;
  PictureModel model;
};

PictureDecoder::PictureDecoder(std::span<const std::byte> coded, std::uint32_t width,
                               std::uint32_t height)
    : coded_(coded), width_(width), pixels_(std::size_t{width} * height) {}
PictureDecoder::PictureDecoder(PictureDecoder&&) noexcept = default;
PictureDecoder& PictureDecoder::operator=(PictureDecoder&&) noexcept = default;
PictureDecoder::~PictureDecoder() = default;

void PictureDecoder::go_on(std::size_t there) {
  const bool all = there >= coded_.size();
  // 16 bits a pixel: twice what noise takes.
  const std::size_t room = std::size_t{2} * width_;
  while (done_ < pixels_.size()) {
    if (!all && (state_ == nullptr ? 4 : state_->coder.read()) + room > there) return;
    if (state_ == nullptr) state_ = std::make_unique<State>(coded_, width_);
    state_->model.code_row(std::span(pixels_).subspan(done_, width_));
    done_ += width_;
    if (all && state_->coder.overrun()) return;
    if (all || state_->coder.read() <= there) continue;
    // The row took more still, of bytes that are not there: from the start, when more are.
    state_.reset();
    done_ = 0;
    return;
  }
}

std::optional<std::vector<std::uint8_t>> PictureDecoder::finish() {
  go_on(coded_.size());
  if (done_ < pixels_.size() || (state_ != nullptr && state_->coder.overrun())) return std::nullopt;
  return std::move(pixels_);
}

}  // namespace modar
