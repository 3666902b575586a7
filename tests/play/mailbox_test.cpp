// The mailbox between two threads: order, newest wins, and an end in any state.
#include "runtime/play/pipeline.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace modar {
namespace {

using std::chrono::milliseconds;
using Box = Mailbox<int>;

TEST(Mailbox, InOrderDeliversEveryItem) {
  constexpr int kItems = 20'000;
  Box box(Delivery::kInOrder);
  std::thread producer([&] {
    for (int i = 1; i <= kItems; ++i) {
      int item = i;
      ASSERT_TRUE(box.post(item));
    }
    box.close();
  });
  int expected = 1;
  int item = 0;
  while (box.take(item)) ASSERT_EQ(item, expected++);
  producer.join();
  EXPECT_EQ(expected, kItems + 1);
  EXPECT_EQ(box.dropped(), 0u);
}

TEST(Mailbox, InOrderHoldsTwoItemsAndThenTheProducerWaits) {
  Box box(Delivery::kInOrder);
  std::atomic<int> posted{0};
  std::thread producer([&] {
    for (int i = 1; i <= 3; ++i) {
      int item = i;
      if (!box.post(item)) return;
      ++posted;
    }
  });
  while (posted < 2) std::this_thread::yield();
  std::this_thread::sleep_for(milliseconds(30));
  EXPECT_EQ(posted, 2);
  int item = 0;
  ASSERT_TRUE(box.take(item));
  EXPECT_EQ(item, 1);
  producer.join();
  EXPECT_EQ(posted, 3);
}

TEST(Mailbox, NewestReplacesWhatWasNotTaken) {
  Box box(Delivery::kNewest);
  for (int i = 1; i <= 5; ++i) {
    int item = i;
    ASSERT_TRUE(box.post(item));
  }
  EXPECT_EQ(box.dropped(), 4u);
  int item = 0;
  ASSERT_TRUE(box.take(item));
  EXPECT_EQ(item, 5);
  EXPECT_EQ(box.take_for(item, milliseconds(1)), Box::Taken::kNothingYet);
}

TEST(Mailbox, NewestOnlyEverMovesForwardAndEndsWithTheLast) {
  constexpr int kItems = 20'000;
  Box box(Delivery::kNewest);
  std::thread producer([&] {
    for (int i = 1; i <= kItems; ++i) {
      int item = i;
      ASSERT_TRUE(box.post(item));
    }
    box.close();
  });
  int last = 0;
  int taken = 0;
  int item = 0;
  while (box.take(item)) {
    ASSERT_GT(item, last);
    last = item;
    ++taken;
  }
  producer.join();
  EXPECT_EQ(last, kItems);
  EXPECT_EQ(box.dropped() + static_cast<std::uint64_t>(taken), std::uint64_t{kItems});
}

TEST(Mailbox, HandsBackABufferInsteadOfFreeingIt) {
  Mailbox<std::vector<int>> box(Delivery::kNewest);
  std::vector<int> first(100, 1);
  const int* first_data = first.data();
  std::vector<int> second(100, 2);
  ASSERT_TRUE(box.post(first));
  ASSERT_TRUE(box.post(second));
  EXPECT_EQ(second.data(), first_data);
}

TEST(Mailbox, ClosedDeliversWhatStandsAndRefusesMore) {
  for (const Delivery delivery : {Delivery::kInOrder, Delivery::kNewest}) {
    Box box(delivery);
    int item = 7;
    ASSERT_TRUE(box.post(item));
    box.close();
    box.close();
    int late = 8;
    EXPECT_FALSE(box.post(late));
    EXPECT_EQ(late, 8);
    EXPECT_FALSE(box.post(late)) << "a second late post must not wait";
    ASSERT_TRUE(box.take(item));
    EXPECT_EQ(item, 7);
    EXPECT_FALSE(box.take(item));
    EXPECT_FALSE(box.take(item)) << "a second late take must not wait";
    EXPECT_EQ(box.take_for(item, milliseconds(1)), Box::Taken::kClosed);
  }
}

TEST(Mailbox, CloseWakesAWaitingConsumer) {
  for (const Delivery delivery : {Delivery::kInOrder, Delivery::kNewest}) {
    Box box(delivery);
    std::thread consumer([&] {
      int item = 0;
      EXPECT_FALSE(box.take(item));
    });
    std::this_thread::sleep_for(milliseconds(10));
    box.close();
    consumer.join();
  }
}

TEST(Mailbox, CloseWakesAProducerThatWaitsForRoom) {
  Box box(Delivery::kInOrder);
  std::thread producer([&] {
    for (int i = 0;; ++i) {
      int item = i;
      if (!box.post(item)) return;
    }
  });
  std::this_thread::sleep_for(milliseconds(10));
  box.close();
  producer.join();
}

TEST(Mailbox, EndsWhateverBothSidesAreDoing) {
  for (int round = 0; round < 300; ++round) {
    Box box(round % 2 == 0 ? Delivery::kInOrder : Delivery::kNewest);
    std::thread producer([&] {
      for (int i = 0;; ++i) {
        int item = i;
        if (!box.post(item)) return;
      }
    });
    std::thread consumer([&] {
      int item = 0;
      while (box.take(item)) {
      }
    });
    for (int i = 0; i < round % 7; ++i) std::this_thread::yield();
    box.close();
    producer.join();
    consumer.join();
  }
}

TEST(Semaphore, AcquireForGivesUpInTimeAndTakesWhatIsThere) {
  Semaphore semaphore(0);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(semaphore.acquire_for(milliseconds(20)));
  EXPECT_GE(std::chrono::steady_clock::now() - start, milliseconds(15));
  semaphore.release();
  EXPECT_TRUE(semaphore.acquire_for(milliseconds(0)));
}

}  // namespace
}  // namespace modar
