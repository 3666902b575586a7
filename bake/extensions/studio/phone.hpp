// The page on a phone in the same network.
#pragma once

#include "bake/extensions/studio/http_reply.hpp"

namespace modar {

struct Session;

/// POST api/phone: writes the page and serves it as `modar web --serve --live` does; {"url",
/// "qr_svg"}.
Result<Answer> post_phone(Session& session);
/// DELETE api/phone.
Result<Answer> end_phone(Session& session);
/// Phones that show the page show the new bundle.
void refresh_phone(Session& session);

}  // namespace modar
