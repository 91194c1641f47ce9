"""rclpy's own tests that do not pass with callboard's ROS face in its place, each with the reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Listed:
    """Tests with one reason.

    Attributes:
        reason: Why they fail.
        tests: The names of a file, or of a class in it, and the names of its tests there.
    """

    reason: str
    tests: dict[str, str]

    @property
    def names(self) -> list[str]:
        """The full names of the tests."""
        return [f"{where}.{test}" for where, tests in self.tests.items() for test in tests.split()]


LISTED: Final = (
    Listed(
        "They call the objects of C behind nodes, endpoints, events and profiles.",
        {
            "test_action_client.TestActionClient": "test_get_num_entities",
            "test_action_server.TestActionServer": "test_get_num_entities",
            "test_client.TestClient": "test_service_timestamps",
            "test_node.TestNodeAllowUndeclaredParameters": "test_take",
            "test_qos.TestQosProfile": "test_alldata_round_trip test_big_nanoseconds test_simple_round_trip",
            "test_qos_event.TestQoSEvent": (
                "test_call_publisher_rclpy_event_apis test_call_publisher_rclpy_event_matched"
                " test_call_subscription_rclpy_event_apis"
                " test_call_subscription_rclpy_event_matched_unmatched"
                " test_publisher_event_create_destroy test_subscription_event_create_destroy"
            ),
            "test_topic_endpoint_info.TestQosProfile": "test_qos_profile_only_constructor",
            "test_waitable.TestWaitable": (
                "test_waitable_with_client test_waitable_with_guard_condition test_waitable_with_server"
                " test_waitable_with_subscription test_waitable_with_timer"
            ),
        },
    ),
    Listed(
        "They look at private attributes, or import private functions.",
        {
            "test_action_server.TestActionServer": (
                "test_expire_goals_multi test_expire_goals_none test_expire_goals_one"
            ),
            "test_executor.TestExecutor": (
                "test_multi_threaded_executor_num_threads test_shutdown_exception_from_callback_generator"
            ),
            "test_lifecycle": "test_lifecycle_node_init",
            "test_node.TestNode": (
                "test_add_remove_post_set_parameter_callback test_add_remove_pre_set_parameter_callback"
                " test_node_add_on_set_parameter_callback test_node_remove_from_set_callback"
            ),
            "test_parameter_event_handler.TestParameterEventHandler": (
                "test_last_in_first_call_for_parameter_callbacks"
                " test_last_in_first_call_for_parameter_event_callbacks test_parameter_callback"
                " test_parameter_event_callback test_register_parameter_callback"
                " test_register_parameter_event_callback test_resolve_path_empty_path"
                " test_resolve_path_other_namespace test_resolve_path_same_namespace"
            ),
            "test_qos_overriding_options": (
                "test_declare_qos_parameters test_declare_qos_parameters_with_happy_callback"
                " test_declare_qos_parameters_with_id test_declare_qos_parameters_with_overrides"
                " test_declare_qos_parameters_with_unhappy_callback test_get_qos_policy_parameter"
            ),
        },
    ),
    Listed(
        "The texts of errors and warnings are callboard's own.",
        {
            "test_logging.TestLogging": ("test_log_arguments test_log_parameters_changing test_named_logger"),
            "test_node.TestNodeAllowUndeclaredParameters": (
                "test_count_clients_services test_count_publishers_subscribers"
                " test_get_publishers_subscriptions_info_by_topic"
            ),
            "test_qos.TestQosProfile": "test_keep_last_zero_depth_constructor",
            "test_qos_event.TestQoSEvent": "test_default_incompatible_qos_callbacks",
        },
    ),
    Listed(
        "A zero depth is a warning where an endpoint gets it.",
        {"test_qos.TestQosProfile": "test_keep_last_zero_depth_set"},
    ),
    Listed(
        "Events have no objects of their own: `event_handlers` has one for all callbacks that are given.",
        {"test_qos_event.TestQoSEvent": "test_publisher_constructor test_subscription_constructor"},
    ),
    Listed(
        "They need feedback before the answer to the goal, which the action does not promise.",
        {"test_action_server.TestActionServer": "test_different_feedback_type_raises test_feedback"},
    ),
    Listed(
        "The server sends feedback after the result, and the client drops it.",
        {"test_action_client.TestActionClient": "test_send_goal_async_with_feedback_for_another_goal"},
    ),
    Listed(
        "A request for a parameter without a value has an answer with none for it; rclpy's is empty.",
        {
            "test_parameter_client.TestParameterClient": "test_get_uninitialized_parameter",
            "test_parameter_service.TestParameterService": "test_get_uninitialized_parameter",
        },
    ),
    Listed(
        "The first message of a throttled line is logged, even if simulated time is zero.",
        {"test_logging.TestLogging": "test_log_throttle_ros_clock"},
    ),
    Listed(
        "The logger above all others without a level has that of Python's root logger.",
        {"test_logging.TestLogging": "test_root_logger_level"},
    ),
    Listed("Times of two clocks are unequal.", {"test_time.TestTime": "test_time_comparators"}),
    Listed(
        "Arguments that are not UTF-8 are no error.",
        {"test_init_shutdown": "test_init_with_non_utf8_arguments"},
    ),
)

UNFAIR: Final = Listed(
    "rclpy 9.1.2 fails them, too.",
    {
        "test_destruction_order": "test_destruction_order",
        "test_parameter.TestParameter": "test_parameter_dict_from_yaml_file",
        "test_parameter_client.TestParameterClient": (
            "test_load_parameter_file test_load_parameter_file_atomically"
        ),
        "test_type_description_service.TestTypeDescriptionService": "test_get_type_description",
    },
)


def reference() -> str:
    """Return the list as a table in Markdown."""
    rows = [f"| {each.reason} | {', '.join(f'`{name}`' for name in each.names)} |" for each in LISTED]
    return "\n".join(["| reason | tests |", "|---|---|", *rows]) + "\n"
