# Plays frames.gray, 480 x 360 bytes a frame, and prints where the cover is; an app passes the frames of its camera.
extends Spatial

func _ready():
	var camera = $Camera
	camera.connect("found", self, "told", ["found"])
	camera.connect("lost", self, "told", ["lost"])
	var file = File.new()
	file.open("res://frames.gray", File.READ)
	while file.get_position() < file.get_len():
		var image = Image.new()
		image.create_from_data(480, 360, false, Image.FORMAT_L8, file.get_buffer(480 * 360))
		var error = camera.frame(image)
		if error != "":
			print("error ", error)
		var place = $Camera/cover.global_transform
		print("place ", $Camera/cover.visible, " ", var2str([place.basis.x, place.basis.y, place.basis.z, place.origin, camera.fov]).replace("\n", ""))
	get_tree().quit()

func told(name, what):
	print(what, " ", name)
