// `modar ship`: keys, releases, what an update costs. ship_cli.cpp fills the options.
#pragma once

#include <string>
#include <vector>

#include "bake/ship/publish.hpp"

namespace modar {

struct KeygenCommand {
  std::string out;
  std::string pass_phrase_file;
  bool force = false;
};

struct ShipPublishCommand {
  PublishRequest request;
  std::string key_file;
  std::string pass_phrase_file;
  std::string expires;  ///< a time, or empty
  unsigned valid_days = 365;
  bool no_expiry = false;
  int fresh_days = -1;               ///< -1: as the newest release has it
  std::vector<std::string> devices;  ///< NAME=PROFILE[,PROFILE]
  bool quiet = false;
  bool json = false;
};

struct RotateCommand {
  std::string folder;
  std::string key_file;
  std::string pass_phrase_file;
  std::string next_key;  ///< file of the public key that follows
};

struct RootCommand : RotateCommand {
  std::string draft;  ///< file for several to sign; empty: signed and published at once
  std::vector<std::string>
      roots;               ///< public keys of the set that follows; empty: next_key is named
  unsigned threshold = 1;  ///< of these
};

struct TrustCommand {
  std::vector<std::string> keys;
  unsigned threshold = 1;
  std::string out;
};

struct SignCommand {
  std::string draft;
  std::string key_file;
  std::string pass_phrase_file;
};

struct AcceptCommand {
  std::string draft;
  std::string folder;
  std::string trust;  ///< file of the root keys that devices were given
};

struct RefreshCommand {
  std::string folder;
  std::string key_file;
  std::string pass_phrase_file;
};

struct ListCommand {
  std::string folder;
  bool json = false;
};

struct PruneCommand {
  std::string folder;
  std::uint64_t keep = 2;
  bool json = false;
};

struct VerifyCommand {
  std::string place;  ///< a folder, or the address of a mirror
  std::string trust;  ///< file of the public key that devices are given
  bool json = false;
};

struct PlanCommand {
  std::string old_bundle;
  std::string new_bundle;
  std::string link = "2g";
  std::string device;
  RecipeOptions recipe;
  bool json = false;
};

int run_keygen(const KeygenCommand& command);
int run_publish(ShipPublishCommand& command);
int run_rotate(const RotateCommand& command);
/// Writes the root key's word: the next key signs; or a draft of it, or of the root keys that
/// follow.
int run_root(const RootCommand& command);
/// Several public keys in one file, for devices.
int run_trust(const TrustCommand& command);
/// Adds a signature to a draft.
int run_sign(const SignCommand& command);
/// Publishes a draft that enough root keys have signed.
int run_accept(const AcceptCommand& command);
/// Signs that the newest release is still the newest.
int run_refresh(const RefreshCommand& command);
int run_list(const ListCommand& command);
int run_prune(const PruneCommand& command);
/// Reads a release folder or a mirror whole.
int run_verify(const VerifyCommand& command);
int run_plan(const PlanCommand& command);

}  // namespace modar
