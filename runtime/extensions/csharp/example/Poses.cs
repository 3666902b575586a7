// Prints the poses of a pattern in gray frames: Poses BUNDLE FRAMES WIDTH HEIGHT
using System;
using System.Globalization;
using System.IO;
using System.Text;
using Modar;

unsafe static class Poses {
  static string Text(byte* text) {
    int length = 0;
    while (text[length] != 0) ++length;
    return Encoding.UTF8.GetString(text, length);
  }

  static int Failed(modar_error* error) {
    Console.Error.WriteLine("{0}: {1}; {2} [{3}]", Text(error->where), Text(error->cause), Text(error->cure), Text(error->code));
    return error->status;
  }

  static int Main(string[] words) {
    CultureInfo.DefaultThreadCurrentCulture = CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
    modar_error error = modar_error.Sized();
    IntPtr bundle = Native.modar_bundle_open(words[0], &error);
    if (bundle == IntPtr.Zero) return Failed(&error);
    int width = int.Parse(words[2]), height = int.Parse(words[3]);
    modar_camera camera = modar_camera.Sized();
    Native.modar_camera_default(width, height, &camera);
    modar_tracker_options options = modar_tracker_options.Sized();
    options.estimate_camera = 1;
    IntPtr tracker = Native.modar_tracker_create((void*)bundle, &camera, &options, &error);
    if (tracker == IntPtr.Zero) return Failed(&error);
    byte[] frames = File.ReadAllBytes(words[1]);
    for (int at = 0; at < frames.Length; at += width * height) {
      fixed (byte* gray = &frames[at]) {
        if (Native.modar_tracker_step((void*)tracker, gray, (UIntPtr)width, -1, &error) != 0) return Failed(&error);
      }
      modar_pose pose = modar_pose.Sized();
      Native.modar_tracker_pose((void*)tracker, 0, &pose);
      var line = new StringBuilder(pose.visible.ToString());
      for (int i = 0; i < 9; ++i) line.Append(" " + pose.rotation[i].ToString("R"));
      for (int i = 0; i < 3; ++i) line.Append(" " + pose.translation[i].ToString("R"));
      Console.WriteLine(line);
    }
    Native.modar_tracker_destroy((void*)tracker);
    Native.modar_bundle_close((void*)bundle);
    return 0;
  }
}
