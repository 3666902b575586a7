/* phone FILE OFFSET LENGTH WIDTH HEIGHT < frames.nv21: what an app in C asks for, on a bundle inside another file.
 * Prints "width_mm W", "picture W H GRAY...", a line "pose VISIBLE FIT X Y Z" a frame and "pick DISTANCE X Y Z" of the last one. */
#define _XOPEN_SOURCE 700
#include <fcntl.h>
#include <modar/modar.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static modar_error error = {.size = sizeof error};

static void need(int holds, int line) {
  if (holds) return;
  fprintf(stderr, "phone.c:%d: %s: %s\n", line, error.code, error.cause);
  exit(9);
}
#define NEED(holds) need(holds, __LINE__)

static void check_drawing(const modar_bundle* bundle) {
  uint8_t rgba[8 * 8 * 4];
  modar_render_options options = {.size = sizeof options};
  modar_camera camera = {.size = sizeof camera};
  modar_camera_default(8, 8, &camera);
  modar_context* context = modar_context_create(&error);
  NEED(context != NULL);
  modar_renderer* renderer = modar_renderer_create(bundle, NULL, 0, &error);
  NEED(renderer != NULL && modar_renderer_gpu_bytes(renderer) > 0);
  modar_renderer_read_rgba(renderer, NULL); /* before a size is known: nothing */
  NEED(modar_renderer_resize(renderer, 8, 8, &error) == 0);
  modar_render_options_default(&options);
  NEED(options.size == sizeof options && options.lod_pixels == 1.0f);
  options.clear_colour[0] = 0.2f, options.clear_colour[1] = 0.4f, options.lod_pixels = 4.0f;
  modar_renderer_set_options(renderer, &options);
  modar_drawing nothing = {.size = sizeof nothing, .camera = &camera};
  modar_renderer_render(renderer, NULL, &nothing);
  modar_renderer_read_rgba(renderer, rgba);
  NEED(rgba[0] == 51 && rgba[1] == 102 && rgba[2] == 0 && rgba[3] == 255);
  modar_renderer_destroy(renderer);
  modar_context_destroy(context);
}

/* A search on a thread of its own, or within a budget, ends some frames later; counts the frames. */
static int check_search_apart(const modar_bundle* bundle, const modar_camera* camera, const uint8_t* frame,
                              modar_tracker_options options) {
  const struct timespec pause = {0, 5000000};
  int frames = 0;
  modar_tracker* tracker = modar_tracker_create(bundle, camera, &options, &error);
  modar_pose pose = {.size = sizeof pose};
  NEED(tracker != NULL);
  while (!pose.visible && ++frames < 4000) {
    NEED(modar_tracker_step(tracker, frame, (size_t)camera->width, -1, &error) == 0);
    modar_tracker_pose(tracker, 0, &pose);
    if (options.extended) modar_tracker_turn(tracker, (const double[3]){0.0, 0.0, 0.0});
    if (options.async_search) nanosleep(&pause, NULL);
  }
  NEED(pose.visible && !pose.extended && pose.position_sigma == 0.0f);
  modar_tracker_reset(tracker);
  NEED(!modar_tracker_pose(tracker, 0, &pose) && !pose.shown);
  modar_tracker_destroy(tracker);
  return frames;
}

int main(int argc, char** argv) {
  NEED(argc == 6 && modar_version() == MODAR_VERSION_NUMBER);
  int file = open(argv[1], O_RDONLY);
  modar_bundle* bundle = modar_bundle_open_fd(file, atol(argv[2]), atol(argv[3]), &error);
  NEED(bundle != NULL && close(file) == 0);
  printf("width_mm %g\n", modar_pattern_width_mm(bundle, 0));
  int picture_width = 0, picture_height = 0;
  const uint8_t* gray = NULL;
  NEED(modar_pattern_picture(bundle, 0, &picture_width, &picture_height, &gray));
  NEED(!modar_pattern_picture(bundle, 9, &picture_width, &picture_height, &gray));
  printf("picture %d %d", picture_width, picture_height);
  for (int i = 0; i < 16; ++i) { /* the middles of 4 x 4 cells */
    int x = (2 * (i % 4) + 1) * picture_width / 8, y = (2 * (i / 4) + 1) * picture_height / 8, sum = 0;
    for (int k = 0; k < 64; ++k) sum += gray[(y - 4 + k / 8) * picture_width + x - 4 + k % 8];
    printf(" %g", sum / 64.0);
  }
  printf("\n");
  modar_camera camera = {.size = sizeof camera};
  modar_camera_default(atoi(argv[4]), atoi(argv[5]), &camera);
  /* A caller of an older version knows no smoothing. */
  modar_tracker_options older = {.size = offsetof(modar_tracker_options, smooth_ms), .smooth_ms = 1e300};
  modar_tracker_options options = {.size = sizeof options, .search_every = 5, .smooth_ms = 20.0, .estimate_camera = 1};
  modar_tracker_destroy(modar_tracker_create(bundle, &camera, &older, &error));
  modar_tracker* tracker = modar_tracker_create(bundle, &camera, &options, &error);
  NEED(tracker != NULL);
  size_t width = (size_t)camera.width, pixels = width * (size_t)camera.height;
  uint8_t* frame = malloc(pixels * 3 / 2);
  modar_scene scene = {.size = sizeof scene};
  modar_pose pose = {.size = sizeof pose};
  NEED(modar_scene_at(bundle, 0, &scene));
  for (double time = 1; fread(frame, pixels * 3 / 2, 1, stdin) == 1; time += 0.04) {
    NEED(modar_tracker_step(tracker, frame, width, time, &error) == 0);
    modar_tracker_pose(tracker, scene.pattern, &pose);
    printf("pose %d %g %g %g %g\n", pose.visible, pose.fit, pose.translation[0], pose.translation[1],
           pose.translation[2]);
    NEED(modar_tracker_camera(tracker, &camera) > 0.0 && camera.fx == camera.fy);
  }
  NEED(pose.visible && modar_tracker_reason(tracker) == MODAR_REASON_VISIBLE);
  modar_item item = {.size = sizeof item};
  modar_hit hit = {.size = sizeof hit};
  modar_item_place(&item, &scene, &pose);
  const double x = camera.cx + camera.fx * pose.translation[0] / pose.translation[2];
  const double y = camera.cy + camera.fy * pose.translation[1] / pose.translation[2];
  const modar_drawing drawing = {.size = sizeof drawing, .camera = &camera, .items = &item, .item_count = 1};
  NEED(modar_pick(bundle, &drawing, x, y, &hit) == 1 && hit.item == 0);
  NEED(modar_pick(bundle, &drawing, -500, -500, &hit) == 0);
  NEED(modar_pick(bundle, &drawing, x, y, &hit) == 1);
  printf("pick %g %g %g %g\n", hit.distance, hit.point[0], hit.point[1], hit.point[2]);
  modar_tracker_options apart = {.size = sizeof apart, .async_search = 1};
  check_search_apart(bundle, &camera, frame, apart);
  modar_tracker_options bounded = {.size = sizeof bounded, .budget = 12, .extended = 1};
  const int frames = check_search_apart(bundle, &camera, frame, bounded);
  bounded.budget = 0;
  NEED(frames > check_search_apart(bundle, &camera, frame, bounded) && frames < 30);
  check_drawing(bundle);
  free(frame);
  modar_tracker_destroy(tracker);
  modar_bundle_close(bundle);
  return 0;
}
