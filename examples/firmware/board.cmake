# Images for the board: `both` methods, and each alone, whose sizes a robot would have.
enable_language(ASM)
enable_testing()

set(BOARD mps2-an500 CACHE STRING "mps2-an500 (Cortex-M7) or mps2-an386 (Cortex-M4F)")
set(RECORDING "" CACHE FILEPATH "What make_recording.py has written")
set(OPTIMISATION -O2 CACHE STRING "-Os, -O2 or -O3: docs/firmware.md compares them")
if(NOT EXISTS "${RECORDING}")
  message(FATAL_ERROR "RECORDING: no file '${RECORDING}'; write one with make_recording.py")
endif()

set(cpu_mps2-an500 -mcpu=cortex-m7 -mfpu=fpv5-d16)
set(cpu_mps2-an386 -mcpu=cortex-m4 -mfpu=fpv4-sp-d16)
if(NOT DEFINED cpu_${BOARD})
  message(FATAL_ERROR "BOARD: '${BOARD}' is not mps2-an500 or mps2-an386")
endif()

target_compile_options(firmware_options INTERFACE
  ${cpu_${BOARD}} -mthumb -mfloat-abi=hard --specs=nano.specs ${OPTIMISATION} -DNDEBUG
  -ffunction-sections -fdata-sections
  # sqrt is one instruction when nobody reads errno
  -fno-math-errno
  # temporaries of Eigen are on the stack, whatever their size: else it keeps a branch to malloc
  -DEIGEN_ALLOCA=__builtin_alloca -DEIGEN_STACK_ALLOCATION_LIMIT=0xFFFFFFFF
  $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions -fno-rtti -fno-threadsafe-statics
    -fno-use-cxa-atexit -Wdouble-promotion>)

# Nothing can allocate: what refers to the heap, in the image's own code or in a library, refers to
# __wrap_malloc instead, which does not exist.
set(heap malloc calloc realloc free _malloc_r _calloc_r _realloc_r _free_r _sbrk)
list(TRANSFORM heap PREPEND -Wl,--wrap=)
set(linker_script ${CMAKE_CURRENT_SOURCE_DIR}/platform/mps2/mps2.ld)
target_link_options(firmware_options INTERFACE
  ${cpu_${BOARD}} -mthumb -mfloat-abi=hard --specs=nano.specs -nostartfiles
  ${heap} -Wl,--gc-sections -T${linker_script})

add_methods("" float)

add_library(mps2 OBJECT platform/mps2/startup.cpp platform/mps2/recording.S)
target_link_libraries(mps2 PUBLIC firmware_options)
set_source_files_properties(platform/mps2/recording.S PROPERTIES
  COMPILE_DEFINITIONS "RECORDING=\"${RECORDING}\"" OBJECT_DEPENDS ${RECORDING})

# An image with the methods that are named in capitals.
function(add_image name)
  add_executable(${name} platform/mps2/board.cpp)
  set_target_properties(${name} PROPERTIES SUFFIX .elf LINK_DEPENDS ${linker_script})
  target_link_libraries(${name} PRIVATE mps2)
  foreach(method ${ARGN})
    string(TOUPPER ${method} macro)
    target_compile_definitions(${name} PRIVATE REPLAY_${macro})
    target_link_libraries(${name} PRIVATE ${method})
  endforeach()
endfunction()
add_image(image_both paper full)
add_image(image_paper paper)
add_image(image_full full)

# The proof that the heap is out of reach: a program that allocates does not link.
add_executable(allocates EXCLUDE_FROM_ALL platform/mps2/allocates.cpp)
target_link_libraries(allocates PRIVATE mps2)
add_test(NAME heap_does_not_link
  COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR} --target allocates)
set_tests_properties(heap_does_not_link PROPERTIES
  PASS_REGULAR_EXPRESSION "undefined reference to `__wrap_malloc'")
