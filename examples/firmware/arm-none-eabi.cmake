# Toolchain of the boards. No heap: nothing may refer to malloc, see CMakeLists.txt.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_ASM_COMPILER arm-none-eabi-gcc)
# There is no system to run or link a test program on.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
