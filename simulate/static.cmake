# SPDX-License-Identifier: Apache-2.0
# The static solver: equilibria by Newton's method.
find_package(Threads REQUIRED)
target_sources(drape_simulate
  PUBLIC FILE_SET HEADERS FILES static_branches.hpp static_contacts.hpp static_dense.hpp static_dissection.hpp static_factor.hpp static_matrix.hpp static_mixed_factor.hpp
         static_hessian.hpp static_kernels.hpp static_mixture.hpp static_prolong.hpp static_residuals.hpp static_run.hpp static_sensitivity.hpp static_solver.hpp static_split.hpp
  PRIVATE static_branches.cpp static_contact_model.cpp static_contacts.cpp static_dense.cpp static_dissection.cpp static_factor.cpp static_friction.cpp static_matrix.cpp static_mixed_factor.cpp static_hessian.cpp
          static_iterate.cpp static_kernels.cpp static_linear.cpp static_prolong.cpp static_residuals.cpp static_run.cpp static_sensitivity.cpp static_solver.cpp static_split.cpp)
target_link_libraries(drape_simulate PRIVATE Threads::Threads)
drape_program(drape-branches SOURCES branches_main.cpp run_inputs.cpp LINK drapebench::simulate)
drape_program(drape-sensitivity SOURCES sensitivity_main.cpp LINK drapebench::simulate)
drape_test(simulate_static_test
  SOURCES static_branches_test.cpp static_caught_test.cpp static_dissection_test.cpp static_friction_test.cpp static_hessian_test.cpp static_refinement_test.cpp static_residuals_test.cpp static_sensitivity_test.cpp
          static_solver_test.cpp
  LINK drapebench::simulate)
drape_benchmark(simulate_static_benchmark SOURCES static_benchmark.cpp LINK drapebench::simulate drapebench::test_support)

# Other programs on the same scene, where they are installed.
if(TARGET simulate_static_benchmark)
  target_sources(simulate_static_benchmark PRIVATE static_benchmark_peers.cpp)
  target_link_libraries(simulate_static_benchmark PRIVATE fmt::fmt)
  find_package(Bullet QUIET)
  if(BULLET_FOUND)
    target_compile_definitions(simulate_static_benchmark PRIVATE DRAPE_HAVE_BULLET)
    target_include_directories(simulate_static_benchmark SYSTEM PRIVATE ${BULLET_INCLUDE_DIRS})
    target_link_libraries(simulate_static_benchmark PRIVATE BulletSoftBody BulletDynamics BulletCollision LinearMath)
  endif()
endif()
