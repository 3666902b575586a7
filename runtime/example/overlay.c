/* overlay BUNDLE WIDTH HEIGHT < frames.nv21 > pictures.rgba: the bundle's first scene over frames. */
#include <modar/modar.h>
#include <stdio.h>
#include <stdlib.h>

static int fail(const modar_error* e) {
  fprintf(stderr, "overlay: %s: %s; %s [%s]\n", e->where, e->cause, e->cure, e->code);
  return e->status;
}
int main(int argc, char** argv) {
  modar_error error = {.size = sizeof error};
  if (argc < 4) return fputs("overlay BUNDLE WIDTH HEIGHT\n", stderr), 1;
  modar_camera camera = {.size = sizeof camera};
  modar_camera_default(atoi(argv[2]), atoi(argv[3]), &camera);
  size_t width = (size_t)camera.width, pixels = width * (size_t)camera.height;
  modar_context* context = modar_context_create(&error); /* an app with a surface has its own */
  modar_bundle* bundle = context ? modar_bundle_open(argv[1], &error) : NULL;
  modar_tracker* tracker = bundle ? modar_tracker_create(bundle, &camera, NULL, &error) : NULL;
  modar_renderer* renderer = tracker ? modar_renderer_create(bundle, NULL, 0, &error) : NULL;
  if (!renderer || modar_renderer_resize(renderer, camera.width, camera.height, &error)) return fail(&error);
  uint8_t *frame = malloc(pixels * 3 / 2), *rgba = malloc(pixels * 4);
  modar_picture picture = {.size = sizeof picture, .format = MODAR_NV21, .width = camera.width, .height = camera.height,
                           .planes = {frame, frame + pixels}, .strides = {camera.width, camera.width}, .full_range = 1};
  modar_scene scene = {.size = sizeof scene};
  modar_scene_at(bundle, 0, &scene);
  while (fread(frame, pixels * 3 / 2, 1, stdin) == 1) {
    modar_pose pose = {.size = sizeof pose};
    modar_item item = {.size = sizeof item};
    if (modar_tracker_step(tracker, frame, width, -1, &error)) return fail(&error);
    int seen = modar_tracker_pose(tracker, scene.pattern, &pose);
    if (seen) modar_item_place(&item, &scene, &pose);
    fprintf(stderr, "%d %g %g %g\n", seen, pose.translation[0], pose.translation[1], pose.translation[2]);
    modar_drawing drawing = {.size = sizeof drawing, .camera = &camera, .items = &item, .item_count = seen ? 1 : 0};
    modar_renderer_render(renderer, &picture, &drawing);
    modar_renderer_read_rgba(renderer, rgba);
    fwrite(rgba, 4, pixels, stdout);
  }
  free(frame), free(rgba), modar_renderer_destroy(renderer), modar_tracker_destroy(tracker);
  return modar_bundle_close(bundle), modar_context_destroy(context), 0;
}
