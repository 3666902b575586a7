/* ModAR's runtime for C and languages that call C: opens bundles, tracks their patterns in camera
 * frames, and draws their models with OpenGL ES 2.0. Renderer and tracker are independent: a
 * program that uses only one of them links only that one.
 *
 * Handles are opaque. Threads may share a bundle; a tracker, a renderer and a context are used by
 * one thread at a time, and a renderer only while its context is current. A bundle must outlive
 * everything that was created from it. Functions that take a modar_error fill it on failure; it may
 * be NULL. Functions that return int return MODAR_OK on success, else the error's status, unless
 * stated. A handle or pointer that is NULL and must not be is an error "capi.null" where there is a
 * modar_error, else an empty answer: 0, nothing drawn. So is a float or double that is not a number
 * or exceeds 1e12 in amount ("capi.number"); an item with one is not drawn. Matrices are
 * column-major, as in GL.
 *
 * Structures begin with `size`: set it to sizeof of the structure before each is first passed, as
 * in modar_pose pose = {.size = sizeof pose}; and fields that you do not use to 0. The library
 * reads and writes that many bytes and no more, so that later versions can append fields: no
 * structure has padding at its end, and `reserved` is 0. All items of an array have the size of its
 * first one. */
#ifndef MODAR_MODAR_H
#define MODAR_MODAR_H

#include <stddef.h>
#include <stdint.h>

/* The version of this header: 10000 * major + 100 * minor + patch. Below 1.0.0, a program runs with
 * the library of the same major and minor version. */
#define MODAR_VERSION_MAJOR 0
#define MODAR_VERSION_MINOR 1
#define MODAR_VERSION_PATCH 0
#define MODAR_VERSION_NUMBER \
  (10000 * MODAR_VERSION_MAJOR + 100 * MODAR_VERSION_MINOR + MODAR_VERSION_PATCH)

/* Marks functions that may change or go in any release. */
#ifndef MODAR_EXPERIMENTAL
#define MODAR_EXPERIMENTAL
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* MODAR_VERSION_NUMBER of the library that is linked. */
uint32_t modar_version(void);

typedef struct modar_bundle modar_bundle;
typedef struct modar_tracker modar_tracker;
typedef struct modar_renderer modar_renderer;
typedef struct modar_context modar_context;
typedef struct modar_record modar_record;

enum {
  MODAR_OK = 0,
  MODAR_USAGE = 1,       /* the call is wrong */
  MODAR_IO = 2,          /* a file cannot be read */
  MODAR_INVALID = 3,     /* the file is damaged or of another kind */
  MODAR_INTERNAL = 4,    /* internal error */
  MODAR_UNSUPPORTED = 5, /* this machine or this version cannot do that */
};

/* An error, for programs (status, code) and for people. Texts are truncated to fit. */
typedef struct modar_error {
  size_t size;
  int status;    /* MODAR_USAGE, ... */
  char code[64]; /* stable, like "bundle.truncated" */
  char where[192];
  char cause[256];
  char cure[256];
  int reserved;
} modar_error;

/* ---- bundles ---- */

/* Maps the file. Returns NULL and an error if it is not a valid bundle. */
modar_bundle* modar_bundle_open(const char* path, modar_error* error);
/* Opens `length` bytes of an open file from `offset` on: an uncompressed asset of an APK, as
 * returned by AAsset_openFileDescriptor64(). The descriptor may be closed afterwards. The bytes are
 * mapped if the offset is a multiple of 8 (zipalign 8), else copied. */
modar_bundle* modar_bundle_open_fd(int fd, int64_t offset, int64_t length, modar_error* error);
/* Opens bytes that the caller owns, which must outlive the bundle: used in place if they are
 * aligned to 8, else copied. */
modar_bundle* modar_bundle_open_bytes(const void* bytes, size_t size, modar_error* error);
/* NULL is allowed, as in every function that frees. */
void modar_bundle_close(modar_bundle* bundle);

/* modar_bundle_open() checks headers and tables only, so that its cost does not depend on the size.
 * This function reads the whole file and compares the hash of each section: it finds damage by the
 * storage. Returns 0 or an error. Hashing takes 0.25 ms per megabyte on an x86-64 server; on a
 * phone the time to read the file from flash is added. */
int modar_bundle_verify(const modar_bundle* bundle, modar_error* error);

/* Returns 0, or MODAR_IO "io.changed" if the file of modar_bundle_open() was written to, or lost
 * pages under modar_guard_files(): close the bundle. modar_tracker_step() fails with the same error
 * at the next frame, as do modar_renderer_create() and modar_renderer_restore(); what draws does
 * not check. Costs one stat(). Replacing the file by rename() changes nothing here. */
MODAR_EXPERIMENTAL int modar_bundle_intact(const modar_bundle* bundle, modar_error* error);

/* Without this, a process that reads a mapped bundle is ended by SIGBUS if another program has
 * shortened the file or its disk was removed. This function installs a handler for SIGBUS in the
 * whole process that replaces lost pages of bundles by zeros, and passes every other fault to the
 * handler that it replaced (such as a JVM's or a crash reporter's). The library never does so by
 * itself. Call it once, after other handlers are installed; bundles in an APK or in an app's own
 * folder do not need it. */
MODAR_EXPERIMENTAL void modar_guard_files(void);

uint32_t modar_model_count(const modar_bundle* bundle);
uint32_t modar_pattern_count(const modar_bundle* bundle);
uint32_t modar_scene_count(const modar_bundle* bundle);
/* Copy a name, truncated to `size` including its final 0. Return its full length, or 0 for an
 * invalid index. */
size_t modar_model_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);
size_t modar_pattern_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);
/* The bounding box of a model in its own space. Returns 0 and changes nothing for an invalid index.
 */
int modar_model_bounds(const modar_bundle* bundle, uint32_t index, float low[3], float high[3]);

/* The printed width of a pattern in millimetres; 0 if the bundle does not state it. */
double modar_pattern_width_mm(const modar_bundle* bundle, uint32_t index);
/* Copies of its print that are tracked at once where the app does not say: 1 to 16. */
MODAR_EXPERIMENTAL uint32_t modar_pattern_copies(const modar_bundle* bundle, uint32_t index);
/* The gray picture of a pattern as the tracker compares it with frames: `*width` times `*height`
 * bytes in rows without padding, top row first, which stay in the bundle. Returns 1, or 0 and
 * changes nothing if none exists. */
int modar_pattern_picture(const modar_bundle* bundle, uint32_t index, int* width, int* height,
                          const uint8_t** gray);

/* Languages of the bundle's texts as BCP 47 tags ("en", "pt-BR"), by index from 0 on. Copies and
 * returns as the names above. */
MODAR_EXPERIMENTAL size_t modar_language(const modar_bundle* bundle, uint32_t index, char* text,
                                         size_t size);
enum {
  MODAR_TEXT = 0,     /* what to show of a pattern's scene */
  MODAR_ALT_TEXT = 1, /* a description, for screen readers */
  MODAR_TITLE = 2,    /* of a node: its name for people */
  MODAR_CAPTIONS = 3, /* of a video or sound: captions, as a WebVTT file */
};
/* A text of a pattern in a language; several are joined by a space. Copies and returns as the names
 * above, 0 if none. */
MODAR_EXPERIMENTAL size_t modar_pattern_text(const modar_bundle* bundle, uint32_t pattern, int kind,
                                             const char* language, char* text, size_t size);

/* A model on a pattern. place: model space to pattern space. */
typedef struct modar_scene {
  size_t size;
  uint32_t pattern;
  uint32_t model;
  float place[16];
  uint32_t number; /* its index + 1 */
  int reserved;
} modar_scene;
/* Returns 1 and the scene, or 0 for an invalid index. */
int modar_scene_at(const modar_bundle* bundle, uint32_t index, modar_scene* scene);
/* The box of a pattern's content, in the pattern's space. Returns 0 and changes nothing where
 * nothing does. */
int modar_pattern_bounds(const modar_bundle* bundle, uint32_t pattern, float low[3], float high[3]);

/* ---- the camera and its pose ---- */

enum {
  MODAR_RGB = 0,
  MODAR_NV21 = 1,
  MODAR_NV12 = 2,
  MODAR_I420 = 3,
  MODAR_RGBA = 4,        /* alpha is not looked at */
  MODAR_YUV_420_888 = 5, /* Android's Image: planes Y, U and V, chroma with a pixel stride */
};
/* A camera frame, top row first; sides must be even except for MODAR_RGB and MODAR_RGBA. */
typedef struct modar_picture {
  size_t size;
  int format;
  int width;
  int height;
  const uint8_t* planes[3];
  ptrdiff_t strides[3];
  int full_range; /* 1: luma from 0 to 255, as from cameras; 0: 16 to 235 */
  int first_row;  /* the rows that differ from the picture before; row_count 0: all, -1: none */
  int row_count;
  int chroma_step; /* of MODAR_YUV_420_888: bytes from one U or V to the next, the pixel stride of
                      these planes: 1 or 2 */
} modar_picture;
/* Converts a frame to the gray that trackers take: rows of `width` bytes, in `gray`, which may be
 * the picture's own first plane if its rows have no padding. */
int modar_gray(const modar_picture* picture, uint8_t* gray, modar_error* error);

/* A pinhole camera with OpenCV's distortion, in pixels; the centre of the top-left pixel is (0, 0).
 */
typedef struct modar_camera {
  size_t size;
  int width;
  int height;
  double fx, fy, cx, cy;
  double distortion[5]; /* k1 k2 p1 p2 k3 */
} modar_camera;
/* The initial assumption for an unknown camera: its focal length is the frame's longer side. */
void modar_camera_default(int width, int height, modar_camera* camera);
/* Reads a file that `modar calibrate` wrote. */
int modar_camera_read(const char* path, modar_camera* camera, modar_error* error);

/* The pose of a pattern, as in the ModAR paper: 9 + 3 floats and a flag. It maps pattern space (x
 * right, y up, z towards the viewer, the longest side from -1 to 1) to camera space (x right, y
 * down, z forward): X_camera = rotation * X_pattern + translation. */
typedef struct modar_pose {
  size_t size;
  float rotation[9];    /* row by row */
  float translation[3]; /* unit: half of the pattern's longest side */
  int visible;          /* 1: measured in this frame */
  int shown;            /* 1: draw the model (while it is not visible, the pose is extrapolated) */
  int inliers;          /* 0 if it is not visible */
  float fit;            /* share of the examined features that agree with the pose, 0 to 1 */
  float corners[8];     /* x, y in pixels: top left, top right, bottom right, bottom left */
  /* Share of the pattern's textured cells in view that match the picture, 0 to 1; and the mean
   * correlation of these cells, 0 to 1. */
  float agreeing;
  float likeness;
  /* 1: the pattern is covered or out of the frame, and the pose is derived from its surroundings,
   * with these standard deviations: position in half of the pattern's longest side, rotation in
   * radians. */
  int extended;
  float position_sigma;
  float rotation_sigma;
  /* 3 x 4, row by row; all 0: none. While the camera is estimated, no pose explains exactly where a
   * flat pattern's picture is. Draw what belongs on it at
   *   X_camera = rotation * (stretch * (X_pattern, 1)) + translation,
   * as modar_view() does. */
  float stretch[12];
  int reserved;
} modar_pose;

/* How to track. */
typedef struct modar_tracker_options {
  size_t size;
  int async_search; /* 1: search on a separate thread; results then depend on timing */
  int search_every; /* frames between searches for more patterns while one is tracked; 0: default
                       (10) */
  double smooth_ms; /* steadies poses at rest, which may lag by this much; 0: off */
  /* Without async_search: limit of ARMv7 instructions per frame, in millions, at least 12: a search
   * is spread over several frames, with the same results on every phone. 0: no limit. */
  int budget;
  /* 1: learn the static surroundings of the largest pattern, and continue from them while the
   * pattern is covered or out of the frame; requires camera motion beforehand. */
  int extended;
  /* 1: the camera is a guess (modar_camera_default()): estimate its focal length and the aspects of
   * flat patterns from the frames; see modar_tracker_camera(). */
  int estimate_camera;
  int max_instances; /* copies of one pattern that are tracked at once, each with its pose: 1 to 16;
                        0: as many as the bundle states of each. See modar_tracker_copy() */
} modar_tracker_options;
/* options: NULL: all 0. Returns NULL and an error if no pattern of the bundle can be tracked. */
modar_tracker* modar_tracker_create(const modar_bundle* bundle, const modar_camera* camera,
                                    const modar_tracker_options* options, modar_error* error);
void modar_tracker_destroy(modar_tracker* tracker);
/* Forgets tracked patterns, for example after a pause or a cut. */
void modar_tracker_reset(modar_tracker* tracker);
/* Processes a frame of the camera's size, 8-bit gray: the luma plane of NV21, or what modar_gray()
 * makes of other formats. stride: bytes from row to row, at least the camera's width. time_s: the
 * frame's time, which must increase and is used for smoothing; below 0: a 30th of a second after
 * the previous frame's. A frame without a pattern is not an error. */
int modar_tracker_step(modar_tracker* tracker, const uint8_t* gray, size_t stride, double time_s,
                       modar_error* error);
/* Shrinks a gray picture: divides its sides by `factor`, each pixel the mean of a square. Large
 * frames are tracked equally well with a long side of 640 to 1280 pixels, in a fraction of the
 * time. out has (width / factor) * (height / factor) bytes, and may be `gray`. */
void modar_shrink(const uint8_t* gray, size_t stride, int width, int height, int factor,
                  uint8_t* out);
/* The mean of some pixels of a gray picture, 0 to 255. */
MODAR_EXPERIMENTAL double modar_brightness(const uint8_t* gray, size_t stride, int width,
                                           int height);
/* The camera's rotation from the last frame to the next one, from a gyroscope: a rotation vector in
 * radians, in the camera's axes (x right, y down, z forward; those of a phone's sensors differ).
 * Helps `extended`. */
MODAR_EXPERIMENTAL void modar_tracker_turn(modar_tracker* tracker, const double rotation[3]);
/* The pose of a pattern in the newest frame; returns its flag `visible`. */
int modar_tracker_pose(const modar_tracker* tracker, uint32_t pattern, modar_pose* pose);
/* The same of one of its copies, 0 to max_instances - 1. A copy keeps its number while it is
 * tracked, and where it is found again. Copy 0 is what modar_tracker_pose() tells. */
MODAR_EXPERIMENTAL int modar_tracker_copy(const modar_tracker* tracker, uint32_t pattern,
                                          uint32_t copy, modar_pose* pose);
/* A pattern of which the newest frame shows more copies than max_instances; -1: none. Known in
 * frames that are searched. */
MODAR_EXPERIMENTAL int modar_tracker_crowded(const modar_tracker* tracker);
/* The camera with which the newest frame's poses were measured; draw with it. Returns the standard
 * deviation of its focal length in pixels if that is estimated, else 0. */
double modar_tracker_camera(const modar_tracker* tracker, modar_camera* camera);
/* Why no pattern is visible in a frame. Later versions may add numbers. */
enum {
  MODAR_REASON_VISIBLE = 0,             /* one is */
  MODAR_REASON_NO_FEATURES = 1,         /* the frame has no corners to describe */
  MODAR_REASON_FEW_MATCHES = 2,         /* too few features match a pattern's */
  MODAR_REASON_NOT_IN_VIEW = 3,         /* some match, as in any picture, but no pose agrees */
  MODAR_REASON_FAILED_VERIFICATION = 4, /* the pose is impossible, or the frame does not match it */
  MODAR_REASON_LOST_BY_BLUR = 5,        /* it was tracked and should be in view, but cannot match */
  MODAR_REASON_OUT_OF_VIEW = 6,         /* it was tracked and left the frame */
  MODAR_REASON_ANOTHER_PRINT = 7,       /* another print of its series, or its mirror image */
  MODAR_REASON_CURVED = 8,              /* its paper is too curved for a planar pose */
  MODAR_REASON_TOO_SMALL = 9,           /* it may be in view, too small to be found */
  MODAR_REASON_TOO_DARK = 10,           /* the frame is */
  MODAR_REASON_BLURRED = 11,            /* the frame is, and nothing was tracked */
  MODAR_REASON_OVEREXPOSED = 12,        /* the frame is */
  MODAR_REASON_GLARE = 13,              /* light covers the place where it may be */
  MODAR_REASON_AT_THE_EDGE = 14,        /* most of that place is outside the frame */
};
/* Of the newest frame; of several patterns, that of the one that came closest to being visible. -1
 * without a tracker. */
int modar_tracker_reason(const modar_tracker* tracker);
/* Its name, "lost by blur": the constant in lower case, with spaces. "unknown" for other numbers.
 */
const char* modar_reason_text(int reason);

/* ---- the user's own pictures ---- */

/* Looks for one flat thing on a plain table in a photo, a picture with the format MODAR_RGBA.
 * Returns 1 and its corners clockwise from the top left as x, y in pixels (the top left pixel's
 * corner is 0, 0), within some pixels: let people correct them; or 0. */
MODAR_EXPERIMENTAL int modar_photo_corners(const modar_picture* photo, float corners[8]);
enum { MODAR_FLAT_SIDE = 512 };
/* The gray picture between four such corners, as from the front, for modar_record_create(): rows
 * without padding in `gray`, which takes MODAR_FLAT_SIDE * MODAR_FLAT_SIDE bytes. Returns 1, or 0
 * and changes nothing if the corners are not a convex quadrilateral. */
MODAR_EXPERIMENTAL int modar_photo_flat(const modar_picture* photo, const float corners[8],
                                        uint8_t* gray, int* flat_width, int* flat_height);
/* Makes a pattern of a flat picture that its user has taken, as `modar bake` does, to the same
 * bytes: 8-bit gray, top row first, 32 to 1023 pixels a side (modar_shrink() makes it smaller; a
 * longer side of 500 will do). It runs on any thread, and takes 0.4 s of an x86-64 server's time
 * for 300,000 pixels. Returns NULL and an error: "pattern.loop-size", or "pattern.plain" and
 * "pattern.no-features" for a picture with too little in it to be recognised. */
MODAR_EXPERIMENTAL modar_record* modar_record_create(const uint8_t* gray, size_t stride, int width,
                                                     int height, modar_error* error);
/* Its bytes, to be kept for the next start. They belong to the record. They are a bundle's tracker
 * record and keep as long: every later library of bundle format 1 opens them, on every processor.
 * A library that does not know their feature extractor (a newer one's) refuses them: keep the
 * picture as well, and make the record again. Of everything else here nothing may be stored:
 * structures, handles and numbers of patterns, scenes and nodes are those of a run. */
MODAR_EXPERIMENTAL const void* modar_record_bytes(const modar_record* record, size_t* size);
/* Copies and checks such bytes. Returns NULL and an error "tracker.record" if they are damaged or
 * of another feature extractor. */
MODAR_EXPERIMENTAL modar_record* modar_record_open(const void* bytes, size_t size,
                                                   modar_error* error);
MODAR_EXPERIMENTAL void modar_record_close(modar_record* record);
/* Tracks the picture as well; the record is copied. `*pattern` becomes its number for
 * modar_tracker_pose(), after those of the bundle. All patterns are searched anew. Its models are
 * the caller's choice: a modar_scene with any model and place. */
MODAR_EXPERIMENTAL int modar_tracker_add_pattern(modar_tracker* tracker, const modar_record* record,
                                                 uint32_t* pattern, modar_error* error);

/* GL's projection matrix for the camera: maps pixels of the frame to pixels of a viewport that
 * shows it. */
void modar_projection(const modar_camera* camera, double near_plane, double far_plane,
                      float projection[16]);
/* From where modar_orbit() looks. */
typedef struct modar_turntable {
  size_t size;
  double turn; /* radians by which the content is turned about the pattern's normal */
  double tilt; /* radians of the eye above its plane */
  double zoom; /* 1: all fits; 2: twice as large */
} modar_turntable;
/* A view without a camera: the pose of a pattern for a camera that goes around its content and
 * shows all of it and of the pattern. Sets the focal length and centre of `camera`,
 * which has the size of the picture, and `pose`. Returns 0 and changes nothing for an invalid
 * index or size. */
MODAR_EXPERIMENTAL int modar_orbit(const modar_bundle* bundle, uint32_t pattern,
                                   const modar_turntable* from, modar_camera* camera,
                                   modar_pose* pose);
/* Pattern space to GL's eye space (x right, y up, z backward). */
void modar_view(const modar_pose* pose, float view[16]);

/* ---- drawing ---- */

/* Creates an off-screen OpenGL ES 2.0 context and makes it current; programs with a surface use
 * their own. */
modar_context* modar_context_create(modar_error* error);
void modar_context_destroy(modar_context* context);

/* A model to draw. to_eye: model space to GL's eye space. */
typedef struct modar_item {
  size_t size;
  uint32_t model;
  float to_eye[16];
  uint32_t scene;         /* number of the scene whose light to use; 0: a neutral room's */
  float world_to_eye[16]; /* pattern space, to which the light is fixed, to GL's eye space; zeros: a
                             level camera's world */
  float opacity; /* 0 or 1: as baked; between: the background shows through, as through glass */
  uint32_t node; /* number of its node: its index + 1; 0: none. A picture is drawn in place of a
                    model, and to_eye takes the square from -1 to 1 of its plane z = 0 */
  const float* bones; /* the model's pose, as modar_clip_bones(); NULL: as baked */
} modar_item;
/* to_eye = view * place, world_to_eye = view; the rest stays. */
void modar_item_place(modar_item* item, const modar_scene* scene, const modar_pose* pose);
/* The items of a frame, and how they are seen. */
typedef struct modar_drawing {
  size_t size;
  const modar_camera* camera; /* the frame's */
  const float* projection;    /* 16 floats; NULL: that of `camera`, with depth limits that enclose
                                 the items */
  const modar_item* items;
  size_t item_count;
} modar_drawing;

typedef struct modar_render_stats {
  size_t size;
  int draw_calls;
  int state_changes;
  int chunks_drawn;
  int chunks_culled;
  uint64_t triangles;
  uint64_t bytes_uploaded;
} modar_render_stats;

/* Uploads into the current context. device: a profile whose limits to respect ("mali400"), or NULL.
 * gpu_bytes: limit of GL memory for models and textures; 0: that of the profile, or none. */
modar_renderer* modar_renderer_create(const modar_bundle* bundle, const char* device,
                                      uint64_t gpu_bytes, modar_error* error);
/* Of a bundle whose bytes are still coming, as Renderer::create_part() of modar/renderer.hpp.
 * part: 0: only the coarsest is there; 1: modar_renderer_put() uploads the data that GPUs draw
 * from; 2: it uploads the data that views need (modar_renderer_open_wanted()), within gpu_bytes of
 * GL memory. */
MODAR_EXPERIMENTAL modar_renderer* modar_renderer_create_part(const modar_bundle* bundle, int part,
                                                              uint64_t gpu_bytes,
                                                              modar_error* error);
/* Bytes of the bundle from `offset` on, which are uploaded and not kept. */
MODAR_EXPERIMENTAL void modar_renderer_put(modar_renderer* renderer, uint64_t offset,
                                           const void* bytes, size_t size);
/* Opens the next range that the last view lacks, for modar_renderer_put(): its number plus 1, for
 * modar_renderer_have() when all of it was put; 0: nothing. */
MODAR_EXPERIMENTAL uint32_t modar_renderer_open_wanted(modar_renderer* renderer, uint64_t* offset,
                                                       uint64_t* byte_count);
MODAR_EXPERIMENTAL void modar_renderer_have(modar_renderer* renderer, uint32_t number);
void modar_renderer_destroy(modar_renderer* renderer);
/* After a lost context, with the new one current: uploads everything again from the bundle's bytes.
 */
int modar_renderer_restore(modar_renderer* renderer, modar_error* error);
int modar_renderer_resize(modar_renderer* renderer, int width, int height, modar_error* error);
/* How to draw; modar_render_options_default() fills it. */
typedef struct modar_render_options {
  size_t size;
  float light[3]; /* direction to a key light in pattern space (z towards the viewer); zeros: each
                     scene's own light */
  float light_strength;   /* factor on the key light */
  float ambient_strength; /* factor on ambient light */
  float clear_colour[4];
  float lod_pixels; /* largest error of a level of detail on the screen, in pixels; more where a
                       frame would have more than a million triangles, or 100,000 without
                       OpenGL ES 3 */
  int exclusive;    /* 1: nothing else draws in the context; 0: every call restores GL's state */
  int fixed_light;  /* 1: light does not adapt to the camera's pictures of the patterns */
  int samples; /* samples per pixel of modar_renderer_render(), from the next resize on (4: smooth
                * edges); the app's own surface has those that it was created with */
  int reserved;
} modar_render_options;
void modar_render_options_default(modar_render_options* options);
void modar_renderer_set_options(modar_renderer* renderer, const modar_render_options* options);
/* Current GL memory of the bundle, in bytes. */
uint64_t modar_renderer_gpu_bytes(const modar_renderer* renderer);
/* The viewport of a camera frame and its models in the bound framebuffer, in pixels, (0, 0) at the
 * bottom left. The frame is turned clockwise by `rotation`. */
typedef struct modar_surface {
  size_t size;
  int x, y, width, height;
  int rotation;   /* degrees: 0, 90, 180, 270 */
  int mirror;     /* 1: swap left and right after the rotation (front camera) */
  int cover;      /* 1: fill the viewport and crop the frame; 0: show the whole frame, centred */
  int keep_depth; /* 1: keep the depth buffer, to draw a second renderer's items among those of a
                     first, with the same projection */
} modar_surface;
/* Draws into the bound framebuffer, which needs a depth buffer; modar_renderer_resize() is not
 * needed. picture NULL: draws the items only, over the app's own camera picture, for a frame of the
 * camera's size. The resulting alpha is coverage, with premultiplied colours if the surface was
 * transparent. */
void modar_renderer_draw(modar_renderer* renderer, const modar_surface* surface,
                         const modar_picture* picture, const modar_drawing* drawing);
/* Estimates the light from a frame that the app draws itself (picture NULL above), for later draws.
 * Every fourth frame and a smaller copy of the whole frame are enough. drawing: as drawn on the
 * frame; its projection is not used. Makes no GL calls. */
MODAR_EXPERIMENTAL void modar_renderer_observe(modar_renderer* renderer,
                                               const modar_picture* picture,
                                               const modar_drawing* drawing);
/* Converts a touch (pixels from the viewport's top left, y down) to a pixel of the frame. */
void modar_surface_to_frame(const modar_surface* surface, const modar_camera* camera, double x,
                            double y, double* frame_x, double* frame_y);

/* The nearest surface of the items under a pixel of the frame. */
typedef struct modar_hit {
  size_t size;
  size_t item;       /* index into the items */
  float point[3];    /* in the item's model space */
  float distance;    /* from the eye, in eye space */
  uint32_t material; /* number of the material there, for modar_event; 0: it is a picture */
  int reserved;
} modar_hit;
/* Returns 1 and the hit, or 0. Reads the triangles from the bundle's bytes: meant for taps, not for
 * every frame. Transparent parts of pictures are hit, too. The drawing's projection is not used. */
MODAR_EXPERIMENTAL int modar_pick(const modar_bundle* bundle, const modar_drawing* drawing,
                                  double frame_x, double frame_y, modar_hit* hit);

/* ---- nodes and actions: scenes that act ---- */

/* A bundle may name the content of its patterns, hide it at first, and say what happens when a
 * pattern is found or something is tapped. An app that draws the scenes itself shows them all, and
 * nothing happens. */
enum {
  MODAR_NODE_MODEL = 1,   /* the model of a scene */
  MODAR_NODE_PICTURE = 2, /* a rectangle that shows a texture */
  MODAR_NODE_LABEL = 3,   /* a point, a mark to draw there, a title and a text */
  MODAR_NODE_VIDEO = 4,   /* a rectangle that shows a video */
  MODAR_NODE_SOUND = 5,   /* is heard, not seen */
};
typedef struct modar_node {
  size_t size;
  uint32_t pattern;
  int kind;
  uint32_t scene; /* of a model: the number of its scene; else 0 */
  float place[3]; /* pattern space */
  int hidden;     /* 1: until an action shows it */
  uint32_t media; /* of a video or sound: number of its file, its index + 1; else 0 */
  int loops;      /* 1: it begins again where it ends */
  int reserved;
} modar_node;
MODAR_EXPERIMENTAL uint32_t modar_node_count(const modar_bundle* bundle);
/* Returns 1 and the node, or 0 for an invalid index. */
MODAR_EXPERIMENTAL int modar_node_at(const modar_bundle* bundle, uint32_t index, modar_node* node);
/* Copy and return as modar_pattern_name(). The mark of a label is a number or a short word. */
MODAR_EXPERIMENTAL size_t modar_node_name(const modar_bundle* bundle, uint32_t index, char* text,
                                          size_t size);
MODAR_EXPERIMENTAL size_t modar_node_mark(const modar_bundle* bundle, uint32_t index, char* text,
                                          size_t size);
/* kind: MODAR_TITLE, MODAR_TEXT, MODAR_ALT_TEXT or MODAR_CAPTIONS; 0 if none in the language. */
MODAR_EXPERIMENTAL size_t modar_node_text(const modar_bundle* bundle, uint32_t index, int kind,
                                          const char* language, char* text, size_t size);

/* The captions of a node in a language as plain lines: at a time of its video or sound, seconds
 * (empty: nothing), or with a time below 0 all of it. Copies and returns as modar_pattern_name().
 */
MODAR_EXPERIMENTAL size_t modar_node_caption(const modar_bundle* bundle, uint32_t index,
                                             const char* language, double seconds, char* text,
                                             size_t size);

/* A file for the app to decode: H.264 baseline and AAC, of a sound AAC alone, in MP4, the index in
 * front. */
typedef struct modar_media {
  size_t size;
  int width; /* pixels; of a sound 0 */
  int height;
  int sound; /* 1: it has a sound track */
  double seconds;
  const uint8_t* bytes; /* in the bundle */
  size_t byte_count;
} modar_media;
/* Returns 1 and the file, or 0 for an invalid index. */
MODAR_EXPERIMENTAL int modar_media_at(const modar_bundle* bundle, uint32_t index,
                                      modar_media* media);
/* What a video shows from now on: a 2D texture of the renderer's context, its first row on top, at
 * most linear in its filter, which outlives its use here; 0: its poster. */
MODAR_EXPERIMENTAL void modar_renderer_set_video(modar_renderer* renderer, uint32_t node,
                                                 uint32_t texture);

/* The screen: the state of a bundle's nodes, as actions have left them, and of the models, as the
 * visitor's hand has. */
typedef struct modar_screen modar_screen;
MODAR_EXPERIMENTAL modar_screen* modar_screen_create(const modar_bundle* bundle,
                                                     modar_error* error);
MODAR_EXPERIMENTAL void modar_screen_destroy(modar_screen* screen);
/* As at the start: nothing was found, and models are as baked. Switches stay. */
MODAR_EXPERIMENTAL void modar_screen_reset(modar_screen* screen);

enum {
  MODAR_TOUCH_DOWN = 0,
  MODAR_TOUCH_MOVE = 1,
  MODAR_TOUCH_UP = 2,
  MODAR_TOUCH_CANCEL = 3, /* it went, and was no tap */
};
typedef struct modar_touch {
  size_t size;
  int kind;
  int finger;  /* any number that it keeps while it is down; a mouse is a finger, too */
  double x, y; /* from the top left of the screen, which is `width` times `height` large: at least 1
                  each, in any unit */
  double width, height;
} modar_touch;
enum {
  MODAR_NOTHING = 0,
  MODAR_MOVED = 1,  /* draw anew */
  MODAR_TAPPED = 2, /* modar_pick() there tells what */
};
/* A finger across the screen turns models once around, along it half around above the pattern
 * (without a camera only: before one, visitors walk); two fingers resize, from a fifth to five
 * times. Returns MODAR_NOTHING, MODAR_MOVED or MODAR_TAPPED. */
MODAR_EXPERIMENTAL int modar_screen_touch(modar_screen* screen, const modar_touch* touch);
enum {
  MODAR_TURN = 0, /* by 10 degrees a step */
  MODAR_TILT = 1, /* the same, upward */
  MODAR_SIZE = 2, /* by a tenth a step */
  MODAR_RESET = 3,
  MODAR_SOUND = 4, /* on or off, as the next two; no steps */
  MODAR_PAUSED = 5,
  MODAR_CAPTIONS_SHOWN = 6,
};
/* A key or a button; others do nothing. steps: presses, or parts of one; negative ones in the other
 * direction. */
MODAR_EXPERIMENTAL void modar_screen_press(modar_screen* screen, int button, double steps);
/* A look without a camera from now on, until modar_screen_reset(): gestures move the eye, and
 * modar_screen_items() leaves models as baked. present: 1: in the first four seconds it goes once
 * around. time_s: seconds. */
MODAR_EXPERIMENTAL void modar_screen_look_around(modar_screen* screen, uint32_t pattern,
                                                 double time_s, int present);
/* A frame of a camera. number: of the first pattern that is shown, its index + 1; 0: none, because
 * of modar_tracker_reason(). brightness: modar_brightness() of the frame. time_s: seconds. */
MODAR_EXPERIMENTAL void modar_screen_follow(modar_screen* screen, double time_s, uint32_t number,
                                            int reason, double brightness);
enum {
  MODAR_STATE_START = 0,
  MODAR_STATE_LOOKING = 1, /* for patterns, in a camera's frames */
  MODAR_STATE_SEEN = 2,    /* one is shown */
  MODAR_STATE_AROUND = 3,  /* without a camera */
};
/* What to tell a visitor who looks for a pattern. */
enum {
  MODAR_HINT_LOOK = 0, /* what to look for */
  MODAR_HINT_CLOSER = 1,
  MODAR_HINT_DARK = 2, /* turn on a light */
  MODAR_HINT_BLURRED = 3,
  MODAR_HINT_OUTSIDE = 4, /* it left the frame */
  MODAR_HINT_HOLD = 5,    /* hold still, and face it */
  MODAR_HINT_BRIGHT = 6,  /* it reflects light, or the frame is too bright */
  MODAR_HINT_WHOLE = 7,   /* show all of it */
  MODAR_HINT_FLAT = 8,    /* lay it flat */
};
typedef struct modar_status {
  size_t size;
  int state;
  int hint;         /* changes when nothing was shown for a second, so that it can be read */
  uint32_t pattern; /* number of the pattern whose words are shown, for a second after it went; 0:
                       none */
  int sound;        /* 1: videos and sounds are heard: the visitor asked, or tapped what plays */
  int paused;       /* 1: they wait */
  int captions;     /* 1: shown */
} modar_status;
MODAR_EXPERIMENTAL void modar_screen_status(const modar_screen* screen, modar_status* status);
/* The visitor's turn and zoom at a time, for modar_orbit(). Returns 1, or 0 and changes nothing. */
MODAR_EXPERIMENTAL int modar_screen_turntable(modar_screen* screen, double time_s,
                                              modar_turntable* from);
/* A pattern of the visitor's own, with the number that modar_tracker_add_pattern() gives it, shows
 * the model of a scene, at its place. Returns 1, or 0 for an invalid index. */
MODAR_EXPERIMENTAL int modar_screen_add_pattern(modar_screen* screen, uint32_t scene);
MODAR_EXPERIMENTAL void modar_screen_forget_patterns(modar_screen* screen);

enum {
  MODAR_SEEN = 0,  /* the pattern `subject` is on the screen: tell it in every step */
  MODAR_TAP = 1,   /* the node `subject` was tapped */
  MODAR_ENDED = 2, /* the video or sound `subject`, which does not loop, is at its end */
};
typedef struct modar_event {
  size_t size;
  int kind;
  uint32_t subject;  /* index of the pattern or node */
  uint32_t material; /* of a tap on a model: as in modar_hit; else 0 */
  int reserved;
} modar_event;
enum {
  MODAR_PLAY = 1,  /* play the video or sound `node`, from where it was, or from its beginning after
                      its end */
  MODAR_PAUSE = 2, /* pause it */
  MODAR_SHOW_TEXT = 6, /* show the title and text of the label `node` */
  MODAR_OPEN_LINK = 7, /* ask the visitor whether to open modar_action_address() of `action` */
};
typedef struct modar_command {
  size_t size;
  int kind;
  uint32_t node;
  uint32_t action; /* index, or 0xFFFFFFFF: a label that was tapped */
  int reserved;
} modar_command;
/* One step, at least once a frame. time_s: seconds, which do not fall. The pattern counts as lost
 * when it was not seen for more than a second. Returns how many commands there are for the app.
 * Allocates nothing as long as there are no more events than patterns and nodes. */
MODAR_EXPERIMENTAL size_t modar_screen_step(modar_screen* screen, double time_s,
                                            const modar_event* events, size_t count);
/* Of the last step: returns 1 and the command, or 0 for an invalid index. */
MODAR_EXPERIMENTAL int modar_screen_command(const modar_screen* screen, size_t index,
                                            modar_command* command);
/* Copies and returns as modar_pattern_name(): begins with https://. */
MODAR_EXPERIMENTAL size_t modar_action_address(const modar_bundle* bundle, uint32_t action,
                                               char* text, size_t size);
MODAR_EXPERIMENTAL int modar_screen_shown(const modar_screen* screen, uint32_t node);
/* 1: step and draw on, even if no frame comes: something turns, or a delay runs. */
MODAR_EXPERIMENTAL int modar_screen_waiting(const modar_screen* screen);

/* A movement of a model. One model's follow each other. */
typedef struct modar_clip {
  size_t size;
  uint32_t model;
  float seconds;
} modar_clip;
MODAR_EXPERIMENTAL uint32_t modar_clip_count(const modar_bundle* bundle);
/* Returns 1 and the clip, or 0 for an invalid index. */
MODAR_EXPERIMENTAL int modar_clip_at(const modar_bundle* bundle, uint32_t index, modar_clip* clip);
/* Copies and returns as modar_pattern_name(). */
MODAR_EXPERIMENTAL size_t modar_clip_name(const modar_bundle* bundle, uint32_t index, char* text,
                                          size_t size);
/* From the next step on, a scene's model plays a clip of its own from the beginning; within blend_s
 * seconds (usually 0.3) its present pose turns into that. loops: 1: again and again; 0: its last
 * pose stays. What the bundle says for a scene is played from when its pattern is found, unless a
 * clip is playing then. Returns 1, or 0 and changes nothing. */
MODAR_EXPERIMENTAL int modar_clip_play(modar_screen* screen, uint32_t scene, uint32_t clip,
                                       int loops, double blend_s);
/* The pose stays. */
MODAR_EXPERIMENTAL void modar_clip_stop(modar_screen* screen, uint32_t scene);
/* Number of the clip that moves a scene's model, its index + 1; 0: none does, or it has ended. */
MODAR_EXPERIMENTAL uint32_t modar_clip_playing(const modar_screen* screen, uint32_t scene);
/* The pose of a scene's model in the last step in which its pattern was seen: 12 floats a bone, the
 * rows of a matrix from the baked model to its pose. Copies at most `capacity` floats;
 * returns how many there are, 0 before a clip was played. */
MODAR_EXPERIMENTAL size_t modar_clip_bones(const modar_screen* screen, uint32_t scene, float* rows,
                                           size_t capacity);

/* What of a pattern is to be drawn: the models of its scenes and its pictures, without hidden
 * ones, turned as actions and the visitor say. view: modar_view() of its pose. items: `capacity` of
 * them, the first with its size set; as many as the bundle has scenes and nodes are enough. Poses
 * are the screen's, until its next step. Returns how many it filled. */
MODAR_EXPERIMENTAL size_t modar_screen_items(modar_screen* screen, uint32_t pattern,
                                             const float view[16], modar_item* items,
                                             size_t capacity);

/* Where a label is drawn: with a mark of constant size, faded where it is covered. */
typedef struct modar_label {
  size_t size;
  float x, y;     /* pixel of the frame */
  float distance; /* from the eye, in eye space */
  int covered;    /* 1: an item is in front of its point */
} modar_label;
/* Returns 1 and the label, or 0 if it is hidden, behind the camera, or no label. view: modar_view()
 * of its pattern's pose. drawing: the last drawing; without items, nothing covers the label, which
 * saves the time of modar_pick(). */
MODAR_EXPERIMENTAL int modar_label_project(const modar_screen* screen, uint32_t node,
                                           const modar_drawing* drawing, const float view[16],
                                           modar_label* label);

/* Draws the picture (NULL: the clear colour) and the items over it off-screen, in the picture's (or
 * camera's) aspect. drawing NULL: the picture alone. */
void modar_renderer_render(modar_renderer* renderer, const modar_picture* picture,
                           const modar_drawing* drawing);
/* Copies the rendered picture to the bound framebuffer, as large as it fits. */
void modar_renderer_show(modar_renderer* renderer, int window_width, int window_height);
/* Reads the rendered picture, top row first: width * height * 4 bytes, none before a size is known.
 */
void modar_renderer_read_rgba(modar_renderer* renderer, uint8_t* rgba);
/* Of the last modar_renderer_render() or modar_renderer_draw(). */
void modar_renderer_stats(const modar_renderer* renderer, modar_render_stats* stats);

#ifdef __cplusplus
}

namespace modar {
/// An empty structure of the C API with its size set.
template <class Struct>
Struct sized() {
  Struct empty{};
  empty.size = sizeof empty;
  return empty;
}
}  // namespace modar
#endif

#endif
