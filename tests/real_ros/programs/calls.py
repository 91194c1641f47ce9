"""Clients, services, timeouts, callback groups, and futures that are cancelled or never done."""

from __future__ import annotations

import asyncio
import threading

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until

WAIT_SEC = 10.0
SHORT_SEC = 0.05


def answer(request, response):
    """Say that the request was served."""
    response.success, response.message = True, "served"
    return response


def state(future):
    """Return what a future says of itself; of one that is cancelled, only that."""
    return "cancelled" if future.cancelled() else future.done()


def four_threads(context):
    """Make an executor."""
    return MultiThreadedExecutor(4, context=context)


def spinning(context, *nodes, kind=MultiThreadedExecutor):
    """Spin nodes in a thread; return the executor and the thread."""
    executor = kind(context=context)
    for node in nodes:
        executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    return executor, thread


def call_that_blocks():
    """Call while another thread spins."""
    with running_node() as node:
        node.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        executor, thread = spinning(node.context, node)
        client.wait_for_service(timeout_sec=WAIT_SEC)
        response = client.call(Trigger.Request(), timeout_sec=WAIT_SEC)
        executor.shutdown()
        thread.join(WAIT_SEC)
        return [response.success, response.message, type(response).__name__]


def call_that_times_out():
    """Call a server whose node nobody spins."""
    with running_node() as node:
        other = Node("other", context=node.context)
        other.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        executor, thread = spinning(node.context, node)
        client.wait_for_service(timeout_sec=WAIT_SEC)
        raised = outcome(client.call, Trigger.Request(), timeout_sec=SHORT_SEC)
        executor.shutdown()
        thread.join(WAIT_SEC)
        other.destroy_node()
        return raised


def call_of_another_type():
    """Call with what is no request, with and without waiting."""
    with running_node() as node:
        client = node.create_client(Trigger, "s")
        wrong = [None, Trigger.Response(), SetBool.Request(), Trigger.Request, {}]
        return [[outcome(call, each) for each in wrong] for call in (client.call, client.call_async)]


def call_in_a_callback():
    """Call a service of the same node in a handler, in groups that let both run."""
    with running_node() as node:
        group = ReentrantCallbackGroup()
        client = node.create_client(Trigger, "inner", callback_group=group)

        def outer(request, response):
            inner = client.call(Trigger.Request(), timeout_sec=WAIT_SEC)
            response.success, response.message = inner.success, "outer " + inner.message
            return response

        node.create_service(Trigger, "inner", answer, callback_group=group)
        node.create_service(Trigger, "outer", outer, callback_group=group)
        caller = node.create_client(Trigger, "outer", callback_group=group)
        executor, thread = spinning(node.context, node, kind=four_threads)
        caller.wait_for_service(timeout_sec=WAIT_SEC)
        response = caller.call(Trigger.Request(), timeout_sec=WAIT_SEC)
        executor.shutdown()
        thread.join(WAIT_SEC)
        return [response.success, response.message]


def call_in_a_coroutine():
    """Await a call in a handler, with one thread."""
    with running_node() as node:
        client = node.create_client(Trigger, "inner", callback_group=ReentrantCallbackGroup())

        async def outer(request, response):
            inner = await client.call_async(Trigger.Request())
            response.success, response.message = inner.success, "outer " + inner.message
            return response

        node.create_service(Trigger, "inner", answer, callback_group=MutuallyExclusiveCallbackGroup())
        node.create_service(Trigger, "outer", outer)
        caller = node.create_client(Trigger, "outer", callback_group=MutuallyExclusiveCallbackGroup())
        caller.wait_for_service(timeout_sec=WAIT_SEC)
        future = caller.call_async(Trigger.Request())
        spin_until(node, future.done)
        return [future.result().success, future.result().message]


def cancelled_call():
    """Cancel a call before it is answered; the answer changes nothing."""
    with running_node() as node:
        seen = []

        def serve(request, response):
            seen.append("served")
            return answer(request, response)

        node.create_service(Trigger, "s", serve)
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda future: seen.append("done"))
        future.cancel()
        states = [state(future)]
        other = client.call_async(Trigger.Request())
        spin_until(node, other.done)
        states += [state(future), outcome(future.result), state(other)]
        return [states, seen.count("done"), other.result().message]


def removed_call():
    """Remove a pending call, twice, and one that is done."""
    with running_node() as node:
        node.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        removed, other = client.call_async(Trigger.Request()), client.call_async(Trigger.Request())
        results = [outcome(client.remove_pending_request, removed) for _ in range(2)]
        spin_until(node, other.done)
        results.append(outcome(client.remove_pending_request, other))
        return [results, state(removed), state(other), outcome(client.remove_pending_request, Future())]


def calls_in_order():
    """Many calls of one client are served in their order, and each gets its own response."""
    with running_node() as node:
        served = []

        def serve(request, response):
            served.append(request.data)
            response.message = str(len(served))
            return response

        node.create_service(SetBool, "s", serve)
        client = node.create_client(SetBool, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        wanted = [number % 3 == 0 for number in range(8)]
        futures = [client.call_async(SetBool.Request(data=each)) for each in wanted]
        spin_until(node, lambda: all(future.done() for future in futures))
        return [served == wanted, [future.result().message for future in futures]]


def callbacks_of_a_response():
    """Callbacks that are added before and after the response, twice, and one that is removed."""
    with running_node() as node:
        node.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        seen = []

        def first(future):
            seen.append(["first", future.result().message])

        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        future = client.call_async(Trigger.Request())
        future.add_done_callback(first)
        future.add_done_callback(first)
        future.add_done_callback(lambda future: seen.append(["second", future.done()]))
        while len(seen) < 3:
            executor.spin_once(timeout_sec=WAIT_SEC)
        future.add_done_callback(first)
        before = len(seen)
        while len(seen) < 4:
            executor.spin_once(timeout_sec=WAIT_SEC)
        executor.remove_node(node)
        return [seen, before, future.exception() is None]


def spin_until_a_call_is_done():
    """Spin until a response is there, until a time is over, and until a future that is done already."""
    with running_node() as node:
        node.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        never, done = Future(), Future()
        done.set_result(7)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        future = client.call_async(Trigger.Request())
        results = [executor.spin_until_future_complete(future, timeout_sec=WAIT_SEC), state(future)]
        results += [executor.spin_until_future_complete(never, timeout_sec=SHORT_SEC), state(never)]
        results += [executor.spin_until_future_complete(done), done.result()]
        results += [executor.spin_until_future_complete(never, timeout_sec=0.0), state(never)]
        executor.remove_node(node)
        return results


def spin_until_a_cancelled_future():
    """A future that is cancelled ends the wait, in a callback or before it begins."""
    with running_node() as node:
        future, cancelled = Future(), Future()
        cancelled.cancel()
        timer = node.create_timer(0.01, future.cancel)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        executor.spin_until_future_complete(cancelled, timeout_sec=WAIT_SEC)
        executor.spin_until_future_complete(future, timeout_sec=WAIT_SEC)
        timer.destroy()
        executor.remove_node(node)
        return [state(future), state(cancelled), outcome(future.result), outcome(future.exception)]


def cancelled_task():
    """Cancel tasks of an executor before they run and while they wait."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        seen, never = [], Future()

        async def wait():
            seen.append("began")
            await never
            seen.append("went on")

        early = executor.create_task(seen.append, "ran")
        early.cancel()
        waiting = executor.create_task(wait)
        executor.spin_once(timeout_sec=SHORT_SEC)
        executor.spin_once(timeout_sec=SHORT_SEC)
        states = [state(early), state(waiting)]
        waiting.cancel()
        states.append(state(waiting))
        never.set_result(None)
        executor.spin_once(timeout_sec=SHORT_SEC)
        states += [state(waiting), outcome(waiting.result), waiting.executing()]
        executor.remove_node(node)
        return [states, seen]


def results_of_tasks():
    """Tasks of functions, of coroutines, with arguments, and with errors."""
    with running_node() as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)

        async def later(number):
            return number + 1

        def fail():
            raise KeyError("wrong")

        tasks = [
            executor.create_task(later, 1),
            executor.create_task(max, 2, 3),
            executor.create_task(later(4)),
        ]
        for task in tasks:
            executor.spin_until_future_complete(task, timeout_sec=WAIT_SEC)
        failing = executor.create_task(fail)
        raised = outcome(executor.spin_until_future_complete, failing, timeout_sec=WAIT_SEC)
        executor.remove_node(node)
        return [[task.result() for task in tasks], raised, state(failing), outcome(failing.result)]


def failing_handler():
    """A handler that raises ends the spinning with its error; its caller waits."""
    with running_node() as node:

        def fail(request, response):
            raise ValueError("no")

        node.create_service(Trigger, "s", fail)
        client = node.create_client(Trigger, "s")
        client.wait_for_service(timeout_sec=WAIT_SEC)
        client.call_async(Trigger.Request())
        return outcome(spin_until, node, lambda: False)


def handler_without_a_response():
    """A handler that returns None, or something else, ends the spinning with an error."""
    raised = []
    for result in (None, SetBool.Response(), 7):
        with running_node() as node:
            node.create_service(Trigger, "s", lambda request, response, result=result: result)
            client = node.create_client(Trigger, "s")
            client.wait_for_service(timeout_sec=WAIT_SEC)
            client.call_async(Trigger.Request())
            raised.append(outcome(spin_until, node, lambda: False))
    return raised


def exclusive_group():
    """Handlers of one exclusive group never run at once, whatever the threads; those of another do."""
    with running_node() as node:
        lock, most, running = threading.Lock(), [0], [0]

        def serve(request, response):
            with lock:
                running[0] += 1
                most[0] = max(most[0], running[0])
            threading.Event().wait(0.01)
            with lock:
                running[0] -= 1
            return answer(request, response)

        group = MutuallyExclusiveCallbackGroup()
        for name in ("a", "b"):
            node.create_service(Trigger, name, serve, callback_group=group)
        clients = [
            node.create_client(Trigger, name, callback_group=ReentrantCallbackGroup()) for name in ("a", "b")
        ]
        executor, thread = spinning(node.context, node, kind=four_threads)
        for client in clients:
            client.wait_for_service(timeout_sec=WAIT_SEC)
        futures = [client.call_async(Trigger.Request()) for _ in range(4) for client in clients]
        for future in futures:
            done = threading.Event()
            future.add_done_callback(lambda future, done=done: done.set())
            done.wait(WAIT_SEC)
        executor.shutdown()
        thread.join(WAIT_SEC)
        return [most, all(future.result().success for future in futures)]


def groups_have_their_entities():
    """Which entities a group has, and which group an entity gets."""
    with running_node() as node:
        group = ReentrantCallbackGroup()
        service = node.create_service(Trigger, "s", answer, callback_group=group)
        client = node.create_client(Trigger, "s")
        return [
            group.has_entity(service),
            group.has_entity(client),
            node.default_callback_group.has_entity(client),
            service.callback_group is group,
            client.callback_group is node.default_callback_group,
            group.can_execute(service),
            group.beginning_execution(service),
            node.default_callback_group.beginning_execution(client),
            node.default_callback_group.can_execute(client),
            node.default_callback_group.ending_execution(client),
            node.default_callback_group.can_execute(client),
        ]


def destroyed_ends():
    """Use clients and services after they were destroyed, twice."""
    with running_node() as node:
        service, client = node.create_service(Trigger, "s", answer), node.create_client(Trigger, "s")
        pending = client.call_async(Trigger.Request())
        results = [node.destroy_client(client), node.destroy_client(client)]
        results += [node.destroy_service(service), node.destroy_service(service)]
        results += [outcome(client.service_is_ready), outcome(client.call_async, Trigger.Request())]
        results += [
            state(pending),
            outcome(lambda: client.service_name),
            outcome(lambda: service.service_name),
        ]
        results.append([len(list(node.clients)), "/s" in {each.service_name for each in node.services}])
        return results


def names_of_ends():
    """The names of clients and services, remapped and with a namespace."""
    with running_node("-r", "a:=b", namespace="/ns") as node:
        seen = []
        for name in ("a", "/a", "~/a", "c/d"):
            client, service = node.create_client(Trigger, name), node.create_service(Trigger, name, answer)
            seen.append([client.srv_name, client.service_name, service.srv_name, service.service_name])
        return [
            *seen,
            outcome(node.create_client, Trigger, "a b"),
            outcome(node.create_service, Trigger, "", answer),
        ]


def waits_for_a_service():
    """Wait for no time, for a time, and for a server that comes in another thread."""
    with running_node() as node:
        client = node.create_client(Trigger, "s")
        results = [client.wait_for_service(timeout_sec=0.0), client.wait_for_service(timeout_sec=SHORT_SEC)]
        other = Node("other", context=node.context)
        timer = threading.Timer(SHORT_SEC, lambda: other.create_service(Trigger, "s", answer))
        timer.start()
        results.append(client.wait_for_service(timeout_sec=WAIT_SEC))
        timer.join()
        results += [client.wait_for_service(), client.wait_for_service(timeout_sec=0.0)]
        other.destroy_node()
        return results


def awaited_in_asyncio():
    """Await a call in asyncio while a thread spins."""
    with running_node() as node:
        node.create_service(Trigger, "s", answer)
        client = node.create_client(Trigger, "s")
        executor, thread = spinning(node.context, node, kind=SingleThreadedExecutor)
        client.wait_for_service(timeout_sec=WAIT_SEC)

        async def main():
            future = client.call_async(Trigger.Request())
            while not future.done():
                await asyncio.sleep(0.001)
            return future.result().message

        message = asyncio.run(main())
        executor.shutdown()
        thread.join(WAIT_SEC)
        return message
