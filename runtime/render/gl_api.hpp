// OpenGL ES 2.0 and the constants of the extensions that we use. Only files of this room include
// it.
#pragma once

#include <GLES2/gl2.h>
#include <GLES2/gl2ext.h>

namespace modar {

/// Fixed attribute locations of every model program; a location per semantic, rows for instances.
enum AttributeSlot : GLuint {
  kAttributePosition = 0,
  kAttributeNormal = 1,
  kAttributeUv = 2,
  kAttributeColour = 3,
  kAttributeSlot = 4,  ///< the vertex's own choice of a slot
  kAttributeRows = 5,  ///< the first of three rows that step once an instance
  kAttributeCount = 8,
};

}  // namespace modar
