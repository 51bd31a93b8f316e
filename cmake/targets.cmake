# Shared build rules: warnings, optimisation, and one function per kind of target.
add_library(coral_warnings INTERFACE)
add_library(coral::warnings ALIAS coral_warnings)
# -Wrestrict of GCC 12 warns of std::string operator+ without reason (GCC bug 105651).
target_compile_options(coral_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wno-restrict
                                                $<$<BOOL:${CORAL_WERROR}>:-Werror>)

# errno and floating-point traps are never read; without them loops vectorise. Results keep IEEE rules otherwise.
add_compile_options(-fno-math-errno -fno-trapping-math)
if(CORAL_NATIVE)
    add_compile_options(-march=native)
endif()
if(CORAL_SANITIZE)
    add_compile_options(-fsanitize=${CORAL_SANITIZE} -fno-omit-frame-pointer)
    add_link_options(-fsanitize=${CORAL_SANITIZE})
endif()

# coral_module(<name> SOURCES a.cpp ... PUBLIC libs... PRIVATE libs...): library coral::<name> of lib/<name>/.
function(coral_module name)
    cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
    add_library(coral_${name} STATIC ${arg_SOURCES})
    add_library(coral::${name} ALIAS coral_${name})
    target_include_directories(coral_${name} PUBLIC ${PROJECT_SOURCE_DIR}/lib)
    target_link_libraries(coral_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} coral::warnings)
endfunction()

# coral_tool(<name> libs...): program build/<preset>/bin/<name> from tools/<name>.cpp, with its three standard tests.
function(coral_tool name)
    add_executable(${name} ${name}.cpp)
    target_link_libraries(${name} PRIVATE coral::cli ${ARGN} coral::warnings)
    target_precompile_headers(${name} REUSE_FROM coral_cli)
    install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    set_property(GLOBAL APPEND PROPERTY CORAL_TOOLS ${name})
endfunction()

# coral_test(<name> SOURCES a_test.cpp ... LIBS libs...): one GoogleTest program per module, found test by test by ctest.
function(coral_test name)
    cmake_parse_arguments(arg "" "" "SOURCES;LIBS" ${ARGN})
    add_executable(test_${name} ${arg_SOURCES})
    target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
    target_link_libraries(test_${name} PRIVATE ${arg_LIBS} GTest::gtest_main coral::warnings)
    target_compile_definitions(test_${name} PRIVATE
        CORAL_SOURCE_DIR="${PROJECT_SOURCE_DIR}" CORAL_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
    include(GoogleTest)
    gtest_discover_tests(test_${name} DISCOVERY_MODE PRE_TEST PROPERTIES LABELS ${name})
endfunction()
