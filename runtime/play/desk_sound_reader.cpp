// Sounds by libavformat and libavcodec, read from memory.
#include "desk_sound_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libavutil/mem.h>
}

namespace modar {
namespace {

constexpr int kBufferBytes = 1 << 15;  // of a read; libavformat's own files have as many

/// The bytes as libavformat reads a file.
struct MemoryInput {
  std::span<const std::byte> bytes;
  std::size_t at = 0;

  static int read(void* self, std::uint8_t* to, int size) {
    auto& input = *static_cast<MemoryInput*>(self);
    const std::size_t count =
        std::min(static_cast<std::size_t>(size), input.bytes.size() - input.at);
    if (count == 0) return AVERROR_EOF;
    std::memcpy(to, input.bytes.data() + input.at, count);
    input.at += count;
    return static_cast<int>(count);
  }

  static std::int64_t seek(void* self, std::int64_t offset, int whence) {
    auto& input = *static_cast<MemoryInput*>(self);
    const auto size = static_cast<std::int64_t>(input.bytes.size());
    if (whence == AVSEEK_SIZE) return size;
    if (whence == SEEK_CUR) offset += static_cast<std::int64_t>(input.at);
    if (whence == SEEK_END) offset += size;
    if (offset < 0 || offset > size) return -1;
    input.at = static_cast<std::size_t>(offset);
    return offset;
  }
};

struct Freed {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVIOContext* io) const {
    av_freep(&io->buffer);
    avio_context_free(&io);
  }
};

class FfmpegSound final : public SoundReader {
 public:
  explicit FfmpegSound(std::span<const std::byte> file) : input_{file} {}

  /// The fault, or null.
  const char* open() {
    av_log_set_level(AV_LOG_QUIET);
    auto* buffer = static_cast<std::uint8_t*>(av_malloc(kBufferBytes));
    io_.reset(avio_alloc_context(buffer, kBufferBytes, 0, &input_, MemoryInput::read, nullptr,
                                 MemoryInput::seek));
    AVFormatContext* format = avformat_alloc_context();
    if (io_ == nullptr || format == nullptr) return "there is no memory for it";
    format->pb = io_.get();
    if (avformat_open_input(&format, "", nullptr, nullptr) < 0) return "it is not a sound file";
    format_.reset(format);
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(format, AVMEDIA_TYPE_AUDIO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr) return "it has no sound that FFmpeg decodes";
    codec_.reset(avcodec_alloc_context3(codec));
    packet_.reset(av_packet_alloc());
    frame_.reset(av_frame_alloc());
    if (codec_ == nullptr || packet_ == nullptr || frame_ == nullptr)
      return "there is no memory for it";
    const bool opened = avcodec_parameters_to_context(codec_.get(), track().codecpar) >= 0 &&
                        avcodec_open2(codec_.get(), codec, nullptr) >= 0;
    if (!opened || codec_->sample_rate <= 0) return "its decoder cannot be opened";
    // AAC decodes to separate channels of floats, and bundles have nothing else.
    return codec_->sample_fmt == AV_SAMPLE_FMT_FLTP ? nullptr : "its samples are not floats";
  }

  [[nodiscard]] int rate() const override { return codec_->sample_rate; }

  bool read(std::vector<float>& samples) override {
    while (avcodec_receive_frame(codec_.get(), frame_.get()) < 0) {
      if (!feed()) return false;
    }
    append(samples);
    return true;
  }

  void seek(double seconds) override {
    const AVRational base = track().time_base;
    const double units = seconds * base.den / std::max(1, base.num);
    av_seek_frame(format_.get(), stream_, static_cast<std::int64_t>(units), AVSEEK_FLAG_BACKWARD);
    avcodec_flush_buffers(codec_.get());
    from_ = seconds;
    drained_ = false;
  }

 private:
  [[nodiscard]] const AVStream& track() const { return *format_->streams[stream_]; }

  /// The next packet of the track to the decoder, at the end none; false: it has had all.
  bool feed() {
    if (drained_) return false;
    for (;;) {
      if (av_read_frame(format_.get(), packet_.get()) < 0) {
        drained_ = true;
        return avcodec_send_packet(codec_.get(), nullptr) >= 0;
      }
      const bool ours = packet_->stream_index == stream_;
      const int sent = ours ? avcodec_send_packet(codec_.get(), packet_.get()) : 0;
      av_packet_unref(packet_.get());
      if (ours && sent >= 0) return true;
    }
  }

  /// More than two channels are mixed into both sides evenly.
  void append(std::vector<float>& samples) {
    const int channels = frame_->ch_layout.nb_channels;
    const auto channel = [this](int i) {
      return reinterpret_cast<const float*>(frame_->extended_data[i]);
    };
    for (int i = skipped(); i < frame_->nb_samples; ++i) {
      float left = channel(0)[i];
      float right = channel(channels == 2 ? 1 : 0)[i];
      if (channels > 2) {
        for (int c = 1; c < channels; ++c) left += channel(c)[i];
        left /= static_cast<float>(channels);
        right = left;
      }
      samples.push_back(left);
      samples.push_back(right);
    }
  }

  /// Samples of the frame before the time that seek() asked for.
  int skipped() {
    if (from_ <= 0 || frame_->pts == AV_NOPTS_VALUE) return 0;
    const double begins = static_cast<double>(frame_->pts) * av_q2d(track().time_base);
    const double early = (from_ - begins) * codec_->sample_rate;
    if (early >= frame_->nb_samples) return frame_->nb_samples;
    from_ = 0;
    return static_cast<int>(std::max(0.0, std::round(early)));
  }

  MemoryInput input_;
  std::unique_ptr<AVIOContext, Freed> io_;
  std::unique_ptr<AVFormatContext, Freed> format_;  ///< goes before what it reads by
  std::unique_ptr<AVCodecContext, Freed> codec_;
  std::unique_ptr<AVPacket, Freed> packet_;
  std::unique_ptr<AVFrame, Freed> frame_;
  int stream_ = -1;
  double from_ = 0;
  bool drained_ = false;
};

}  // namespace

Result<std::unique_ptr<SoundReader>> open_sound(std::span<const std::byte> file,
                                                const std::string& name) {
  auto sound = std::make_unique<FfmpegSound>(file);
  if (const char* fault = sound->open()) {
    return fail(ExitCode::kInvalidInput, "input.damaged", name, fault,
                "`modar check BUNDLE` reports its fault");
  }
  return sound;
}

}  // namespace modar
