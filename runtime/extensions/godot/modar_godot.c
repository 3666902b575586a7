/* Godot 3: the class ModarTracker over libmodar.so, as a GDNative library. Methods answer an error's text, "" for none. */
#include <gdnative_api_struct.gen.h>
#include <modar/modar.h>
#include <stdio.h>
#include <string.h>

static const godot_gdnative_core_api_struct* api;
static const godot_gdnative_ext_nativescript_api_struct* scripts;

typedef struct tracking {
  modar_bundle* bundle;
  modar_tracker* tracker;
  modar_camera camera;
} tracking;

static godot_variant text_of(const char* text) {
  godot_string string;
  godot_variant answer;
  api->godot_string_new(&string);
  api->godot_string_parse_utf8(&string, text);
  api->godot_variant_new_string(&answer, &string);
  api->godot_string_destroy(&string);
  return answer;
}

static godot_variant fault(const modar_error* error) {
  char text[1024];
  snprintf(text, sizeof text, "%s: %s; %s [%s]", error->where, error->cause, error->cure, error->code);
  return text_of(text);
}

static void close_all(tracking* self) {
  modar_tracker_destroy(self->tracker);
  modar_bundle_close(self->bundle);
  self->tracker = NULL;
  self->bundle = NULL;
}

static void* create(godot_object* object, void* data) {
  tracking* self = api->godot_alloc(sizeof *self);
  (void)object, (void)data;
  memset(self, 0, sizeof *self);
  self->camera.size = sizeof self->camera;
  return self;
}

static void destroy(godot_object* object, void* data, void* user) {
  (void)object, (void)data;
  close_all(user);
  api->godot_free(user);
}

/* open(path: String, width: int, height: int): frames of that size will come. */
static godot_variant open_bundle(godot_object* object, void* data, void* user, int count, godot_variant** words) {
  tracking* self = user;
  modar_error error = {.size = sizeof error};
  modar_tracker_options options = {.size = sizeof options, .estimate_camera = 1};
  (void)object, (void)data;
  if (count != 3) return text_of("open() takes a path, a width and a height");
  close_all(self);
  godot_string path = api->godot_variant_as_string(words[0]);
  godot_char_string bytes = api->godot_string_utf8(&path);
  self->bundle = modar_bundle_open(api->godot_char_string_get_data(&bytes), &error);
  api->godot_char_string_destroy(&bytes);
  api->godot_string_destroy(&path);
  if (!self->bundle) return fault(&error);
  modar_camera_default((int)api->godot_variant_as_int(words[1]), (int)api->godot_variant_as_int(words[2]), &self->camera);
  self->tracker = modar_tracker_create(self->bundle, &self->camera, &options, &error);
  return self->tracker ? text_of("") : fault(&error);
}

/* step(gray: PoolByteArray) */
static godot_variant step(godot_object* object, void* data, void* user, int count, godot_variant** words) {
  tracking* self = user;
  modar_error error = {.size = sizeof error};
  (void)object, (void)data;
  if (count != 1 || !self->tracker) return text_of("step() takes gray bytes, after open()");
  godot_pool_byte_array gray = api->godot_variant_as_pool_byte_array(words[0]);
  int failed = 0, fits = api->godot_pool_byte_array_size(&gray) == self->camera.width * self->camera.height;
  if (fits) {
    godot_pool_byte_array_read_access* access = api->godot_pool_byte_array_read(&gray);
    failed = modar_tracker_step(self->tracker, api->godot_pool_byte_array_read_access_ptr(access), (size_t)self->camera.width, -1, &error);
    api->godot_pool_byte_array_read_access_destroy(access);
  }
  api->godot_pool_byte_array_destroy(&gray);
  if (!fits) return text_of("the frame is not width * height bytes large");
  modar_tracker_camera(self->tracker, &self->camera);
  return failed ? fault(&error) : text_of("");
}

/* place(pattern: int): pattern space to the camera's space as a Transform; null: not shown, or no such pattern. */
static godot_variant place(godot_object* object, void* data, void* user, int count, godot_variant** words) {
  tracking* self = user;
  modar_pose pose = {.size = sizeof pose};
  godot_variant answer;
  (void)object, (void)data;
  api->godot_variant_new_nil(&answer);
  int64_t pattern = count == 1 ? api->godot_variant_as_int(words[0]) : -1;
  if (!self->tracker || pattern < 0 || pattern >= modar_pattern_count(self->bundle)) return answer;
  modar_tracker_pose(self->tracker, (uint32_t)pattern, &pose);
  if (!pose.shown) return answer;
  float view[16];
  modar_view(&pose, view); /* GL's eye space is that of Godot's cameras */
  godot_vector3 rows[3], origin;
  godot_basis basis;
  godot_transform transform;
  for (int row = 0; row < 3; ++row) api->godot_vector3_new(&rows[row], view[row], view[4 + row], view[8 + row]);
  api->godot_vector3_new(&origin, view[12], view[13], view[14]);
  api->godot_basis_new_with_rows(&basis, &rows[0], &rows[1], &rows[2]);
  api->godot_transform_new(&transform, &basis, &origin);
  api->godot_variant_new_transform(&answer, &transform);
  return answer;
}

/* pattern(number: int): its name, "" if none. */
static godot_variant pattern_name(godot_object* object, void* data, void* user, int count, godot_variant** words) {
  tracking* self = user;
  char name[1025] = "";
  (void)object, (void)data;
  if (count == 1 && self->bundle) modar_pattern_name(self->bundle, (uint32_t)api->godot_variant_as_int(words[0]), name, sizeof name);
  return text_of(name);
}

/* focal(): of the frames, pixels. */
static godot_variant focal(godot_object* object, void* data, void* user, int count, godot_variant** words) {
  godot_variant answer;
  (void)object, (void)data, (void)count, (void)words;
  api->godot_variant_new_real(&answer, ((tracking*)user)->camera.fy);
  return answer;
}

void GDN_EXPORT godot_gdnative_init(godot_gdnative_init_options* options) {
  api = options->api_struct;
  for (unsigned i = 0; i < api->num_extensions; ++i) {
    if (api->extensions[i]->type == GDNATIVE_EXT_NATIVESCRIPT) scripts = (const void*)api->extensions[i];
  }
}

void GDN_EXPORT godot_gdnative_terminate(godot_gdnative_terminate_options* options) {
  (void)options;
  api = NULL;
}

void GDN_EXPORT godot_nativescript_init(void* handle) {
  static const struct {
    const char* name;
    godot_variant (*run)(godot_object*, void*, void*, int, godot_variant**);
  } methods[] = {{"open", open_bundle}, {"step", step}, {"place", place}, {"pattern", pattern_name}, {"focal", focal}};
  godot_instance_create_func made = {create, NULL, NULL};
  godot_instance_destroy_func gone = {destroy, NULL, NULL};
  scripts->godot_nativescript_register_class(handle, "ModarTracker", "Reference", made, gone);
  for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i) {
    godot_instance_method method = {methods[i].run, NULL, NULL};
    godot_method_attributes attributes = {GODOT_METHOD_RPC_MODE_DISABLED};
    scripts->godot_nativescript_register_method(handle, "ModarTracker", methods[i].name, attributes, method);
  }
}
