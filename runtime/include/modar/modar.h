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
/* The same on bytes of the caller's (an asset of an APK), 8-byte aligned, which must outlive it. */
modar_bundle* modar_bundle_open_bytes(const void* bytes, size_t size, modar_error* error);
void modar_bundle_close(modar_bundle* bundle); /* NULL is fine, as in every function that frees */

uint32_t modar_model_count(const modar_bundle* bundle);
uint32_t modar_pattern_count(const modar_bundle* bundle);
uint32_t modar_scene_count(const modar_bundle* bundle);
/* Copy a name, cut to `size` with its closing 0; answer its whole length, 0 for no such index. */
size_t modar_model_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);
size_t modar_pattern_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size);

/* A model that stands on a pattern. place: model space to pattern space. */
typedef struct modar_scene {
  uint32_t pattern;
  uint32_t model;
  float place[16];
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
/* What is assumed of an unknown camera: focal length = width. */
modar_camera modar_camera_default(int width, int height);

/* The paper's answer for a pattern: 9 + 3 floats and the flag. Pattern space (x right, y up, z
 * towards the viewer, the largest side from -1 to 1) to camera space (x right, y down, z forward):
 * X_camera = rotation * X_pattern + translation. */
typedef struct modar_pose {
  float rotation[9];    /* row by row */
  float translation[3]; /* half largest sides of the pattern */
  int visible;          /* 1: measured in this frame */
  int shown;            /* 1: draw the model (the pose may be of the last frame but one) */
  int inliers;          /* 0 where it is not visible */
  float corners[8];     /* x, y in pixels: top left, top right, bottom right, bottom left */
} modar_pose;

/* NULL where no pattern of the bundle can be tracked. */
modar_tracker* modar_tracker_create(const modar_bundle* bundle, const modar_camera* camera,
                                    modar_error* error);
void modar_tracker_destroy(modar_tracker* tracker);
/* One frame of the camera's size, 8 bits of gray a pixel: the luma plane of NV21. stride: bytes
 * from row to row. That no pattern is in it is no error. */
int modar_tracker_step(modar_tracker* tracker, const uint8_t* gray, size_t stride,
                       modar_error* error);
/* The pose of a pattern in the newest frame; answers its flag `visible`. */
int modar_tracker_pose(const modar_tracker* tracker, uint32_t pattern, modar_pose* pose);
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

/* A model of the bundle to draw. to_eye: model space to GL's eye space. */
typedef struct modar_item {
  uint32_t model;
  float to_eye[16];
} modar_item;
/* to_eye = view * place. */
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
/* exclusive: 1 if nobody else draws in the context between frames: what is set then stays set. */
void modar_renderer_set_light(modar_renderer* renderer, const float direction[3], int exclusive);
/* Draws the picture (NULL: black) and the items over it. projection NULL: for `camera`, with depth
 * limits that enclose the items. */
void modar_renderer_render(modar_renderer* renderer, const modar_picture* picture,
                           const modar_camera* camera, const float projection[16],
                           const modar_item* items, size_t count);
/* Puts what was drawn on the window's framebuffer, as large as it fits. */
void modar_renderer_show(modar_renderer* renderer, int window_width, int window_height);
/* Copies what was drawn, top row first: width * height * 4 bytes. */
void modar_renderer_read_rgba(modar_renderer* renderer, uint8_t* rgba);
modar_render_stats modar_renderer_stats(const modar_renderer* renderer);

#ifdef __cplusplus
}
#endif

#endif
