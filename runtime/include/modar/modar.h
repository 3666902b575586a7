/* ModAR's runtime for C, and for whatever calls C: bundles, the pose of their patterns in camera
 * frames, and their models drawn with OpenGL ES 2.0. The renderer needs nothing of the tracker, and
 * the other way round: a program that links only one of them carries only that one.
 *
 * Handles are opaque. A bundle may be shared by threads; a tracker, a renderer and a context are
 * used by one thread at a time, and a renderer only where its context is current. Bundles outlive
 * what was made of them. Functions that take a modar_error fill it when they fail; it may be NULL.
 * Those that answer an int answer 0 where all is well, else the error's exit_code.
 * Matrices are column-major, as GL takes them. */
#ifndef MODAR_MODAR_H
#define MODAR_MODAR_H

#include <stddef.h>
#include <stdint.h>

/* The version of this header: 10000 * major + 100 * minor + patch. Below 1.0.0, a program runs with the library of
 * the same major and minor version. */
#define MODAR_VERSION_MAJOR 0
#define MODAR_VERSION_MINOR 1
#define MODAR_VERSION_PATCH 0
#define MODAR_VERSION_NUMBER (10000 * MODAR_VERSION_MAJOR + 100 * MODAR_VERSION_MINOR + MODAR_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif

/* MODAR_VERSION_NUMBER of the library that is linked. */
uint32_t modar_version(void);

typedef struct modar_bundle modar_bundle;
typedef struct modar_tracker modar_tracker;
typedef struct modar_renderer modar_renderer;
typedef struct modar_context modar_context;

/* What went wrong, for a program (exit_code, code) and for a person. Texts are cut to fit. */
typedef struct modar_error {
  int exit_code;  /* 1 usage, 2 input or output, 3 invalid input, 4 a bug of ours, 5 unsupported */
  char code[64];  /* stable, like "bundle.truncated" */
  char where[192];
  char cause[256];
  char cure[256];
} modar_error;

/* ---- bundles ---- */

/* Maps the file; NULL and an error where it is no good bundle. */
modar_bundle* modar_bundle_open(const char* path, modar_error* error);
/* `length` bytes of an open file from `offset` on: an uncompressed asset of an APK, as AAsset_openFileDescriptor64()
 * gives it. The descriptor may be closed. Mapped where the offset is a multiple of 8 (zipalign 8), else copied. */
modar_bundle* modar_bundle_open_fd(int fd, int64_t offset, int64_t length, modar_error* error);
/* The same on bytes of the caller's, which must outlive it: aligned to 8 they are used in place, else they are copied. */
modar_bundle* modar_bundle_open_bytes(const void* bytes, size_t size, modar_error* error);
void modar_bundle_close(modar_bundle* bundle); /* NULL is fine, as in every function that frees */

/* modar_bundle_open looks at headers and tables only, so that it costs the same for any size. This
 * reads the whole file and compares the hash of each section: it finds what the storage has damaged
 * since. 0 or an error. Hashing takes 0.25 ms a megabyte on an x86-64 server; on a phone, what
 * reading the file from flash takes comes on top. */
int modar_bundle_verify(const modar_bundle* bundle, modar_error* error);

uint32_t modar_model_count(const modar_bundle* bundle);
uint32_t modar_pattern_count(const modar_bundle* bundle);
uint32_t modar_scene_count(const modar_bundle* bundle);
/* Copy a name, cut to `size` with its closing 0; answer its whole length, 0 for no such index. */
size_t modar_model_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);
size_t modar_pattern_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);

/* The width that a pattern is printed in, millimetres; 0 where the bundle does not state it. */
double modar_pattern_width_mm(const modar_bundle* bundle, uint32_t index);

/* A model that stands on a pattern. place: model space to pattern space. */
typedef struct modar_scene {
  uint32_t pattern;
  uint32_t model;
  float place[16];
  uint32_t number; /* its index plus 1 */
} modar_scene;
/* 1 and the scene, or 0 for no such index. */
int modar_scene_at(const modar_bundle* bundle, uint32_t index, modar_scene* scene);

/* ---- the camera and its pose ---- */

/* Pinhole with OpenCV's distortion. Pixels; the top-left pixel's centre is (0, 0). */
typedef struct modar_camera {
  int width;
  int height;
  double fx, fy, cx, cy;
  double distortion[5]; /* k1 k2 p1 p2 k3 */
} modar_camera;
/* What is assumed of an unknown camera, to begin with: focal length = the frame's longer side. */
modar_camera modar_camera_default(int width, int height);
/* Reads the file that `modar calibrate` writes. */
int modar_camera_read(const char* path, modar_camera* camera, modar_error* error);

/* The paper's answer for a pattern: 9 + 3 floats and the flag. Pattern space (x right, y up, z
 * towards the viewer, the largest side from -1 to 1) to camera space (x right, y down, z forward):
 * X_camera = rotation * X_pattern + translation. */
typedef struct modar_pose {
  float rotation[9];    /* row by row */
  float translation[3]; /* half largest sides of the pattern */
  int visible;          /* 1: measured in this frame */
  int shown;            /* 1: draw the model (while not visible, the pose goes on as it moved) */
  int inliers;          /* 0 where it is not visible */
  float fit;            /* share of the features looked at that agree with the pose, 0 to 1 */
  float corners[8];     /* x, y in pixels: top left, top right, bottom right, bottom left */
  float agreeing;       /* share of the pattern's textured cells in view that look like it, 0 to 1 */
  float likeness;       /* mean correlation of these cells, 0 to 1 */
  int extended;         /* 1: it is hidden or out of the frame, and the pose follows from its surroundings, with these */
  float position_sigma; /* standard deviations, half largest sides of the pattern, */
  float rotation_sigma; /* and radians */
} modar_pose;

/* NULL where no pattern of the bundle can be tracked. */
modar_tracker* modar_tracker_create(const modar_bundle* bundle, const modar_camera* camera,
                                    modar_error* error);
/* How to track. Set `size` to sizeof(modar_tracker_options) and what you do not know to 0: later versions append. */
typedef struct modar_tracker_options {
  size_t size;
  int async_search; /* 1: searches on a thread of its own; then results depend on time */
  int search_every; /* frames between searches for further patterns while one is tracked; 0: 10 */
  double smooth_ms; /* takes the trembling out of resting poses, which may lag by so much; 0: off */
  int budget;       /* without async_search: ARMv7 instructions a frame may take, in millions, 12 or more: a search goes
                     * on over several frames, with the same results on every phone; 0: no limit */
  int extended;     /* 1: learns what stands still around the largest pattern, and goes on from it while the pattern is
                     * hidden or out of the frame; the camera has to move before */
  int estimate_camera; /* 1: the camera is a guess (modar_camera_default()): its focal length, and the aspects of flat
                        * patterns, are estimated from the frames, see modar_tracker_camera() */
} modar_tracker_options;
modar_tracker* modar_tracker_create_with(const modar_bundle* bundle, const modar_camera* camera,
                                         const modar_tracker_options* options, modar_error* error);
void modar_tracker_destroy(modar_tracker* tracker);
/* Forgets what it tracks: after a pause, a cut. */
void modar_tracker_reset(modar_tracker* tracker);
/* One frame of the camera's size, 8 bits of gray a pixel: the luma plane of NV21. stride: bytes
 * from row to row. That no pattern is in it is no error. */
int modar_tracker_step(modar_tracker* tracker, const uint8_t* gray, size_t stride,
                       modar_error* error);
/* The same with the frame's time, rising, which smoothing goes by; modar_tracker_step() counts 30 frames a second. */
int modar_tracker_step_at(modar_tracker* tracker, const uint8_t* gray, size_t stride, double time_s,
                          modar_error* error);
/* How the camera turned from the last frame to the next one, as a gyroscope says: a rotation vector, radians, in the
 * camera's axes (x right, y down, z forward; a phone's sensors have others). Helps `extended`. */
void modar_tracker_turn(modar_tracker* tracker, const double rotation[3]);
/* The pose of a pattern in the newest frame; answers its flag `visible`. */
int modar_tracker_pose(const modar_tracker* tracker, uint32_t pattern, modar_pose* pose);
/* The camera by which the newest frame's poses were measured: draw with it. Answers the standard deviation of its focal
 * length, pixels, while that is estimated; else 0. */
double modar_tracker_camera(const modar_tracker* tracker, modar_camera* camera);
/* Why nothing is visible: "few matches", "lost by blur"...; "visible" where something is. */
const char* modar_tracker_reason(const modar_tracker* tracker);

/* GL's projection for the camera: pixels of the frame land on pixels of a viewport that shows it. */
void modar_projection(const modar_camera* camera, double near_plane, double far_plane,
                      float projection[16]);
/* Pattern space to GL's eye space (x right, y up, z backward). */
void modar_view(const modar_pose* pose, float view[16]);

/* ---- drawing ---- */

/* An off-screen OpenGL ES 2.0 context, made current; programs with a surface have their own. */
modar_context* modar_context_create(modar_error* error);
void modar_context_destroy(modar_context* context);

/* A model of the bundle to draw. to_eye: model space to GL's eye space. Set to 0 what you do not know. */
typedef struct modar_item {
  uint32_t model;
  float to_eye[16];
  uint32_t scene;         /* the number of the scene whose light it has; 0: a neutral room's */
  float world_to_eye[16]; /* the pattern, which light is fixed to, to GL's eye space; zeros: a level camera's world */
} modar_item;
/* to_eye = view * place, world_to_eye = view. */
void modar_item_place(modar_item* item, const modar_scene* scene, const modar_pose* pose);

enum { MODAR_RGB = 0, MODAR_NV21 = 1, MODAR_NV12 = 2, MODAR_I420 = 3 };
/* A camera's frame, top row first; even sides but for MODAR_RGB. */
typedef struct modar_picture {
  int format;
  int width;
  int height;
  const uint8_t* planes[3];
  ptrdiff_t strides[3];
  int full_range; /* 1: luma from 0 to 255, as cameras have it; 0: 16 to 235 */
  int first_row;  /* only so many rows differ from the picture before; row_count 0: all of them */
  int row_count;
} modar_picture;

typedef struct modar_render_stats {
  int draw_calls;
  int state_changes;
  int chunks_drawn;
  int chunks_culled;
  uint64_t triangles;
  uint64_t bytes_uploaded;
} modar_render_stats;

/* Uploads into the current context. device: a profile whose limits are kept ("mali400"), or NULL.
 * gpu_bytes: how much GL memory models and textures may take, 0: what the profile says, or all. */
modar_renderer* modar_renderer_create(const modar_bundle* bundle, const char* device,
                                      uint64_t gpu_bytes, modar_error* error);
void modar_renderer_destroy(modar_renderer* renderer);
/* After the context was lost, with the new one current: everything anew from the bundle's bytes. */
int modar_renderer_restore(modar_renderer* renderer, modar_error* error);
int modar_renderer_resize(modar_renderer* renderer, int width, int height, modar_error* error);
/* How to draw. modar_render_options_default() fills it, `size` too; later versions append. */
typedef struct modar_render_options {
  size_t size;
  float light[3];         /* to a key light, pattern space (z towards the viewer); zeros: each scene's own light */
  float light_strength;   /* factor on the key light */
  float ambient_strength; /* factor on what comes from all around */
  float clear_colour[4];
  float lod_pixels; /* a level of detail may be off by so much on the screen */
  int exclusive;    /* 1 if nobody else draws in the context; 0: every call leaves GL's state as it found it */
  int fixed_light;  /* 1: light does not follow what the camera's pictures show of the patterns */
  int samples;      /* a pixel of what modar_renderer_render() draws, from the next resize on (4: smooth edges); the app's
                     * own surface has those that it was made with */
} modar_render_options;
void modar_render_options_default(modar_render_options* options);
void modar_renderer_set_options(modar_renderer* renderer, const modar_render_options* options);
/* Bytes that the bundle takes in GL memory now. */
uint64_t modar_renderer_gpu_bytes(const modar_renderer* renderer);
/* direction: as modar_render_options.light. exclusive: 1 if nobody else draws in the context between frames: what is set then stays set. */
void modar_renderer_set_light(modar_renderer* renderer, const float direction[3], int exclusive);
/* Where a camera's frame and its models go in the framebuffer that is bound: pixels, (0, 0) at the bottom left. What is
 * upright there is the frame turned clockwise. Set `size` to sizeof(modar_surface) and what you do not know to 0. */
typedef struct modar_surface {
  size_t size;
  int x, y, width, height;
  int rotation;   /* degrees: 0, 90, 180, 270 */
  int mirror;     /* 1: left and right change places after the turn (front camera) */
  int cover;      /* 1: fills the viewport and crops the frame; 0: shows the whole frame in its middle */
  int keep_depth; /* 1: for a second renderer's items among those of a first, same projection */
} modar_surface;
/* Draws into the framebuffer that is bound, which needs a depth buffer; modar_renderer_resize() is not needed. picture
 * NULL: the items alone, over what is there (the app's own camera picture), for a frame of the camera's size. Alpha
 * ends as coverage, colours premultiplied where the surface was transparent. projection as below. */
void modar_renderer_draw(modar_renderer* renderer, const modar_surface* surface,
                         const modar_picture* picture, const modar_camera* camera,
                         const float projection[16], const modar_item* items, size_t count);
/* The light of a frame that the app draws by itself (picture NULL above): later draws follow it. Every fourth frame is
 * enough, and a smaller copy of the whole frame. camera: the frame's; items: as they are drawn on it. No GL call. */
void modar_renderer_observe(modar_renderer* renderer, const modar_picture* picture,
                            const modar_camera* camera, const modar_item* items, size_t count);
/* The frame's pixel under a touch: pixels from the viewport's top left, y down. */
void modar_surface_to_frame(const modar_surface* surface, const modar_camera* camera, double x,
                            double y, double* frame_x, double* frame_y);

/* The nearest surface of the items under a pixel of the frame. */
typedef struct modar_hit {
  size_t item;       /* index into the items */
  float point[3];    /* in the item's model space */
  float distance;    /* from the eye, in eye space */
} modar_hit;
/* 1 and the hit, or 0. Reads the triangles from the bundle's bytes: for a tap, not for every frame. */
int modar_pick(const modar_bundle* bundle, const modar_camera* camera, double frame_x,
               double frame_y, const modar_item* items, size_t count, modar_hit* hit);

/* Draws the picture (NULL: the clear colour) and the items over it, off-screen, in the picture's (or camera's) shape. projection NULL: for `camera`, with depth
 * limits that enclose the items. */
void modar_renderer_render(modar_renderer* renderer, const modar_picture* picture,
                           const modar_camera* camera, const float projection[16],
                           const modar_item* items, size_t count);
/* Puts what was drawn on the framebuffer that is bound, as large as it fits. */
void modar_renderer_show(modar_renderer* renderer, int window_width, int window_height);
/* Copies what was drawn, top row first: width * height * 4 bytes. */
void modar_renderer_read_rgba(modar_renderer* renderer, uint8_t* rgba);
modar_render_stats modar_renderer_stats(const modar_renderer* renderer);

#ifdef __cplusplus
}
#endif

#endif
