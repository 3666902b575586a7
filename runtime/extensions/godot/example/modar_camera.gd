# A camera whose picture is `texture`; its children named as patterns are placed on these.
extends Camera

signal found(name)
signal lost(name)

export(String, FILE) var bundle = ""
var texture = ImageTexture.new()
var frame_size = Vector2()
var tracker = preload("res://tracker.gdns").new()

# A frame of the app's camera, or of a video. Returns an error's text, "" for none.
func frame(image: Image) -> String:
	texture.create_from_image(image, 0)
	var gray = image.duplicate()
	gray.convert(Image.FORMAT_L8)
	if image.get_size() != frame_size:
		frame_size = image.get_size()
		var opened = tracker.open(ProjectSettings.globalize_path(bundle), int(frame_size.x), int(frame_size.y))
		if opened != "":
			return opened
	var error = tracker.step(gray.get_data())
	if error != "":
		return error
	fov = rad2deg(2 * atan(frame_size.y / 2 / tracker.focal()))
	var number = 0
	while tracker.pattern(number) != "":
		show_on(tracker.pattern(number), tracker.place(number))
		number += 1
	return ""

func show_on(name: String, place) -> void:
	var node = get_node_or_null(name)
	if node == null:
		return
	var known = node.visible
	node.visible = place != null
	if place != null:
		node.transform = place
	if known != node.visible:
		emit_signal("found" if node.visible else "lost", name)
