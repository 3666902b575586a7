// The door of bake/pattern: what other rooms of the workstation include.
#pragma once

#include "bake/pattern/calibrate.hpp"      // `modar calibrate`: a camera from views of a plane
#include "bake/pattern/confusion.hpp"      // which patterns of a project are taken for each other
#include "bake/pattern/find_corners.hpp"   // the corners of a flat object in a photo
#include "bake/pattern/picture.hpp"        // reading pattern pictures, in gray and at their size
#include "bake/pattern/record.hpp"         // a picture to its features and its tracker record
#include "bake/pattern/rectify.hpp"        // a photo of a flat object to its frontal picture
#include "bake/pattern/scene.hpp"          // camera frames of known pose, rendered
#include "bake/pattern/score.hpp"          // how well a picture serves as a pattern
#include "bake/pattern/shape.hpp"          // prints on bottles and cups
#include "bake/pattern/simulate.hpp"       // the working range of a printed pattern
#include "bake/pattern/surface_scene.hpp"  // the same of curved prints
#include "bake/pattern/target_file.hpp"    // image targets of 8th Wall
#include "bake/pattern/trial.hpp"          // the device's tracker on rendered frames
