// Videos by the library of media, sounds by it and SDL2's audio.
#include "scene_media.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <SDL.h>

#include "desk_media.hpp"
#include "formats/captions.hpp"
#include "formats/meta_text.hpp"

namespace modar {
namespace {

/// Seconds of sound that wait in the device: more than a slow frame takes, little enough that a
/// change of the volume is heard soon.
constexpr double kQueuedSeconds = 0.3;

/// The language of the user's messages: "de" of "de_AT.UTF-8"; empty: unknown.
std::string user_language() {
  for (const char* name : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    const std::string language(value);
    return language == "C" || language == "POSIX"
               ? ""
               : language.substr(0, language.find_first_of("_.@"));
  }
  return "";
}

/// Of a node, in the user's language, or in the first that the bundle has.
std::string captions_of(const BundleView& bundle, const NodeRecord& node) {
  const std::string_view pattern = bundle.name(bundle.patterns()[node.pattern].name);
  const std::string_view name = bundle.name(node.name);
  const std::string wanted = user_language();
  std::string captions;
  bool best = false;
  visit_node_texts(bundle.meta(), [&](const MetaText& each) {
    if (each.kind != MetaText::Kind::kCaptions || each.pattern != pattern || each.node != name)
      return;
    const bool better = !best && each.language == wanted;
    if (captions.empty() || better) captions = each.words;
    best |= better;
  });
  return captions;
}

std::string words_of(const BundleView& bundle, const SceneCommand& command) {
  if (command.command == ActionCommand::kLink) {
    return "link " + std::string(bundle.name(bundle.actions()[command.action].address));
  }
  const char* verb = command.command == ActionCommand::kPlay    ? "play "
                     : command.command == ActionCommand::kPause ? "pause "
                                                                : "text ";
  return verb + std::string(bundle.name(bundle.nodes()[command.node].name));
}

/// A label's words in all languages, or the address of a link.
void tell(const BundleView& bundle, const SceneCommand& command, std::string& told) {
  if (command.command == ActionCommand::kLink) {
    told += "modar-play: link: ";
    told += bundle.name(bundle.actions()[command.action].address);
    told += '\n';
  }
  if (command.command != ActionCommand::kText) return;
  const NodeRecord& node = bundle.nodes()[command.node];
  const std::string_view pattern = bundle.name(bundle.patterns()[node.pattern].name);
  const std::string_view name = bundle.name(node.name);
  visit_node_texts(bundle.meta(), [&](const MetaText& each) {
    const bool shown = each.kind == MetaText::Kind::kTitle || each.kind == MetaText::Kind::kText;
    if (each.pattern != pattern || each.node != name || !shown) return;
    told += "modar-play: " + each.node + " [" + each.language + "]: " + each.words + "\n";
  });
}

/// One sound on its way to the device.
class Speaker {
 public:
  explicit Speaker(std::unique_ptr<SoundReader> reader) : reader_(std::move(reader)) {}
  Speaker(const Speaker&) = delete;
  Speaker& operator=(const Speaker&) = delete;
  ~Speaker() {
    if (device_ != 0) SDL_CloseAudioDevice(device_);
  }

  /// False where there is no device for sound.
  bool open() {
    SDL_AudioSpec wanted{};
    wanted.freq = reader_->rate();
    wanted.format = AUDIO_F32SYS;
    wanted.channels = 2;
    wanted.samples = 1024;  // 23 ms at 44.1 kHz
    device_ = SDL_OpenAudioDevice(nullptr, 0, &wanted, nullptr, 0);
    return device_ != 0;
  }

  /// Queued sound stays for play().
  void pause() { SDL_PauseAudioDevice(device_, 1); }

  /// Fills the queue, and sounds. volume: 0 to 1.
  void play(float volume) {
    const auto wanted = static_cast<std::size_t>(kQueuedSeconds * reader_->rate()) * 2;
    std::size_t queued = SDL_GetQueuedAudioSize(device_) / sizeof(float);
    while (queued < wanted) {
      samples_.clear();
      if (!reader_->read(samples_)) break;
      for (float& sample : samples_) sample *= volume;
      SDL_QueueAudio(device_, samples_.data(),
                     static_cast<Uint32>(samples_.size() * sizeof(float)));
      queued += samples_.size();
    }
    SDL_PauseAudioDevice(device_, 0);
  }

  /// To a time from the beginning, seconds.
  void seek(double seconds) {
    SDL_ClearQueuedAudio(device_);
    reader_->seek(seconds);
  }

 private:
  std::unique_ptr<SoundReader> reader_;
  SDL_AudioDeviceID device_ = 0;
  std::vector<float> samples_;
};

/// A node's video or sound.
struct Clip {
  std::uint32_t node = 0;
  const MediaRecord* record = nullptr;
  std::span<const std::byte> file;
  std::string name;
  std::string captions;
  bool loops = false;
  bool playing = false;
  bool at_end = false;
  double position = 0;  ///< seconds
  std::unique_ptr<ClipReader>
      pictures;                      ///< opened when it first plays; until then its poster shows
  std::unique_ptr<Speaker> speaker;  ///< opened when it first sounds
  bool mute = false;                 ///< nothing of it can be heard here
};

class DeskSceneMedia final : public SceneMedia {
 public:
  DeskSceneMedia(const BundleView& bundle, const SceneMediaSetup& setup)
      : bundle_(bundle), setup_(setup) {
    for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) {
      const NodeRecord& node = bundle.nodes()[i];
      if (!plays_media(node)) continue;
      Clip clip;
      clip.node = i;
      clip.record = &bundle.media()[node.subject];
      clip.file = bundle.media_data(node.subject);
      clip.name = bundle.name(clip.record->name);
      clip.captions = captions_of(bundle, node);
      clip.loops = (node.flags & kNodeLoops) != 0;
      clips_.push_back(std::move(clip));
    }
  }

  ~DeskSceneMedia() override {
    clips_.clear();
    if (audio_) SDL_QuitSubSystem(SDL_INIT_AUDIO);
  }

  void advance(double time_s, std::vector<SceneEvent>& events) override {
    const double passed = std::max(0.0, time_s - time_s_);
    time_s_ = std::max(time_s_, time_s);
    for (Clip& clip : clips_) {
      const auto length = static_cast<double>(clip.record->seconds);
      if (!clip.playing) continue;
      clip.position += passed;
      if (clip.position < length) continue;
      if (clip.loops) {
        clip.position = std::fmod(clip.position, length);
        if (clip.speaker) clip.speaker->seek(clip.position);
        continue;
      }
      clip.position = length;
      clip.playing = false;
      clip.at_end = true;
      events.push_back({SceneEvent::Kind::kEnded, clip.node, kNone});
    }
  }

  const SceneState& execute(std::span<const SceneCommand> commands,
                            const Controls& controls) override {
    log_.commands.clear();
    log_.told.clear();
    for (const SceneCommand& command : commands) {
      log_.commands.push_back(words_of(bundle_, command));
      tell(bundle_, command, log_.told);
      play(command);
    }
    sound_ = controls.status().sound != 0;
    volume_ = controls.volume();
    std::string caption;
    for (Clip& clip : clips_) {
      if (clip.playing && controls.status().captions != 0) {
        add_line(words_at(clip.captions, clip.position), caption);
      }
      listen(clip);
    }
    if (caption != log_.caption && !caption.empty()) log_.told += "modar-play: " + caption + "\n";
    log_.caption = std::move(caption);
    return log_;
  }

  Result<void> show(Screen& screen) override {
    for (Clip& clip : clips_) {
      const bool video = clip.record->kind == static_cast<std::uint32_t>(MediaKind::kVideo);
      if (!video || (!clip.playing && clip.pictures == nullptr)) continue;
      if (clip.pictures == nullptr) {
        MODAR_ASSIGN(const Media* library, media());
        MODAR_ASSIGN(clip.pictures, library->open_clip(clip.file, clip.name));
      }
      MODAR_ASSIGN(const bool another, clip.pictures->seek(clip.position));
      if (another || !screen.has_video(clip.node))
        screen.show_video(clip.node, clip.pictures->picture());
    }
    if (title_ != log_.caption)
      screen.set_title(log_.caption.empty() ? "modar-play" : log_.caption);
    title_ = log_.caption;
    return {};
  }

  void hold(bool on) override {
    held_ = on;
    for (Clip& clip : clips_) listen(clip);
  }

 private:
  void play(const SceneCommand& command) {
    const bool plays = command.command == ActionCommand::kPlay;
    if (!plays && command.command != ActionCommand::kPause) return;
    for (Clip& clip : clips_) {
      if (clip.node == command.node) start(clip, plays);
    }
  }

  static void start(Clip& clip, bool plays) {
    if (plays && clip.at_end) {
      clip.position = 0;
      if (clip.speaker) clip.speaker->seek(0);
    }
    clip.at_end = clip.at_end && !plays;
    clip.playing = plays;
  }

  static void add_line(std::string_view words, std::string& caption) {
    if (words.empty()) return;
    if (!caption.empty()) caption += '\n';
    caption += words;
  }

  /// Sound follows what its clip does.
  void listen(Clip& clip) {
    const bool heard = clip.playing && sound_ && !held_ && setup_.audible && !clip.mute &&
                       (clip.record->flags & kMediaSound) != 0;
    if (heard && clip.speaker == nullptr) open_speaker(clip);
    if (clip.speaker == nullptr) return;
    if (heard) {
      clip.speaker->play(volume_);
    } else {
      clip.speaker->pause();
    }
  }

  /// A desk without sound plays on in silence, and says so once.
  void open_speaker(Clip& clip) {
    const auto silent = [&clip](const std::string& cause) {
      clip.mute = true;
      std::fprintf(stderr, "modar-play: %s is not heard: %s\n", clip.name.c_str(), cause.c_str());
    };
    if (!audio_ && SDL_InitSubSystem(SDL_INIT_AUDIO) != 0) return silent(SDL_GetError());
    audio_ = true;
    const auto library = media();
    if (!library) return silent(to_line(library.error()));
    auto reader = (*library)->open_sound(clip.file, clip.name);
    if (!reader) return silent(to_line(reader.error()));
    auto speaker = std::make_unique<Speaker>(std::move(*reader));
    if (!speaker->open()) return silent(SDL_GetError());
    speaker->seek(clip.position);
    clip.speaker = std::move(speaker);
  }

  BundleView bundle_;
  SceneMediaSetup setup_;
  std::vector<Clip> clips_;
  SceneState log_;
  std::string title_;  ///< the caption in the window's title
  double time_s_ = 0;
  float volume_ = 1;
  bool sound_ = false;
  bool held_ = false;
  bool audio_ = false;  ///< SDL's part is there
};

}  // namespace

std::unique_ptr<SceneMedia> open_scene_media(const BundleView& bundle,
                                             const SceneMediaSetup& setup) {
  if (setup.sound && !setup.audible) {
    std::fputs("modar-play: --sound: a file is heard with --realtime only\n", stderr);
  }
  if (bundle.nodes().empty()) return nullptr;
  return std::make_unique<DeskSceneMedia>(bundle, setup);
}

}  // namespace modar
